// SPDX-License-Identifier: Apache-2.0
#include "volume/build/storage.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <random>
#include <string>
#include <system_error>
#include <utility>

#include "volume/error.h"

namespace blockwalk {
namespace {

constexpr std::size_t kPartialDigits = 8;

[[noreturn]] void failSystem(const std::filesystem::path& path, const char* action) {
  throw std::system_error(errno, std::generic_category(), fmt::format("{}: {}", path.string(), action));
}

void writeAll(int descriptor, std::uint64_t offset, std::span<const std::byte> bytes,
              const std::filesystem::path& path) {
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(descriptor, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) failSystem(path, "cannot be written");
    bytes = bytes.subspan(static_cast<std::size_t>(written));
    offset += static_cast<std::uint64_t>(written);
  }
}

void readAll(int descriptor, std::uint64_t offset, std::span<std::byte> out, const std::filesystem::path& path,
             const char* failure) {
  while (!out.empty()) {
    const ssize_t got = ::pread(descriptor, out.data(), out.size(), static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got == 0) errno = EIO;  // somebody else has cut it
    if (got <= 0) failSystem(path, failure);
    out = out.subspan(static_cast<std::size_t>(got));
    offset += static_cast<std::uint64_t>(got);
  }
}

int openUnnamed(const std::filesystem::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC | O_EXCL, 0600);
  if (descriptor >= 0) return descriptor;
  // A file system without O_TMPFILE: a name for an instant.
  if (errno != EOPNOTSUPP && errno != EISDIR && errno != ENOENT)
    failSystem(folder, "no temporary file can be made here");
  std::string name = (folder / ".blockwalk-XXXXXX").string();
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named < 0) failSystem(folder, "no temporary file can be made here");
  ::unlink(name.c_str());
  return named;
}

std::string partialPrefix(const std::filesystem::path& path) {
  return fmt::format(".{}.partial-", path.filename().string());
}

// Removes the partial files of `path` that nobody holds a lock on. Returns those of which that cannot be told.
std::vector<std::filesystem::path> removeLeftovers(const std::filesystem::path& path) {
  std::vector<std::filesystem::path> unknown;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folderOf(path), ignored)) {
    const std::string name = entry.path().filename().string();
    if (!isPartialName(name, path)) continue;
    const int descriptor = ::open(entry.path().c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (descriptor < 0) continue;
    if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) {
      ::unlink(entry.path().c_str());
    } else if (errno != EWOULDBLOCK) {
      unknown.push_back(entry.path());
    }
    ::close(descriptor);
  }
  return unknown;
}

}  // namespace

std::string partialName(const std::filesystem::path& path, std::uint32_t number) {
  return fmt::format("{}{:08x}", partialPrefix(path), number);
}

bool isPartialName(const std::string& name, const std::filesystem::path& path) {
  const std::string prefix = partialPrefix(path);
  return name.starts_with(prefix) && name.size() == prefix.size() + kPartialDigits &&
         name.find_first_not_of("0123456789abcdef", prefix.size()) == std::string::npos;
}

std::filesystem::path folderOf(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

TempBytes::TempBytes(std::filesystem::path folder, std::size_t buffer_bytes)
    : folder_(std::move(folder)), buffer_bytes_(buffer_bytes) {}

TempBytes::~TempBytes() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

TempBytes::TempBytes(TempBytes&& other) noexcept
    : folder_(std::move(other.folder_)),
      buffer_bytes_(other.buffer_bytes_),
      buffer_(std::move(other.buffer_)),
      flushed_(std::exchange(other.flushed_, 0)),
      descriptor_(std::exchange(other.descriptor_, -1)) {}

void TempBytes::append(std::span<const std::byte> bytes) {
  if (buffer_.size() + bytes.size() > buffer_bytes_) flush();
  if (bytes.size() > buffer_bytes_) {
    writeAll(descriptor_, flushed_, bytes, folder_);
    flushed_ += bytes.size();
    return;
  }
  if (buffer_.capacity() < buffer_bytes_) buffer_.reserve(buffer_bytes_);  // doubling would take up to twice as much
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

void TempBytes::flush() {
  if (descriptor_ < 0) descriptor_ = openUnnamed(folder_);
  writeAll(descriptor_, flushed_, buffer_, folder_);
  flushed_ += buffer_.size();
  buffer_.clear();
}

void TempBytes::read(std::uint64_t offset, std::span<std::byte> out) const {
  BLOCKWALK_CHECK(offset, <=, size());
  BLOCKWALK_CHECK(out.size(), <=, size() - offset);
  if (offset < flushed_) {
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(out.size(), flushed_ - offset));
    readAll(descriptor_, offset, out.first(wanted), folder_, "a temporary file here cannot be read");
    out = out.subspan(wanted);
    offset += wanted;
  }
  if (!out.empty()) std::memcpy(out.data(), buffer_.data() + (offset - flushed_), out.size());
}

void TempBytes::clear() {
  buffer_.clear();
  flushed_ = 0;
}

OutputFile::OutputFile(std::filesystem::path path) : path_(std::move(path)) {
  leftovers_ = removeLeftovers(path_);
  std::random_device random;
  // Not mkstemp: its mode 0600 would stay with the finished file.
  for (int attempt = 0; attempt < 100 && descriptor_ < 0; ++attempt) {
    partial_ = folderOf(path_) / partialName(path_, random());
    descriptor_ = ::open(partial_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (descriptor_ < 0 && errno != EEXIST) break;
  }
  if (descriptor_ < 0) failSystem(partial_, "cannot be created");
  ::flock(descriptor_, LOCK_EX | LOCK_NB);  // where a file system has no locks, others leave this one alone as well
}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!partial_.empty()) ::unlink(partial_.c_str());
}

void OutputFile::setLength(std::uint64_t bytes) {
  if (::ftruncate(descriptor_, static_cast<off_t>(bytes)) != 0) failSystem(partial_, "cannot be made long enough");
}

void OutputFile::write(std::uint64_t offset, std::span<const std::byte> bytes) {
  writeAll(descriptor_, offset, bytes, partial_);
}

void OutputFile::read(std::uint64_t offset, std::span<std::byte> out) const {
  readAll(descriptor_, offset, out, partial_, "cannot be read");
}

void OutputFile::beginSync() const { ::sync_file_range(descriptor_, 0, 0, SYNC_FILE_RANGE_WRITE); }

void OutputFile::commit() {
  if (::fsync(descriptor_) != 0) failSystem(partial_, "cannot be written to the disk");
  const int closed = ::close(std::exchange(descriptor_, -1));
  if (closed != 0) failSystem(partial_, "cannot be closed");
  if (::rename(partial_.c_str(), path_.c_str()) != 0) failSystem(path_, "the finished file cannot get this name");
  partial_.clear();
  const std::filesystem::path folder = folderOf(path_);
  const int folder_descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder_descriptor < 0) failSystem(folder, "cannot be opened");
  const int synced = ::fsync(folder_descriptor);
  const int error = errno;
  ::close(folder_descriptor);
  errno = error;
  // Some network file systems cannot sync a folder, which is no fault of the file's.
  if (synced != 0 && error != EINVAL) failSystem(folder, "cannot be written to the disk");
}

}  // namespace blockwalk
