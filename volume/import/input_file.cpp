// SPDX-License-Identifier: Apache-2.0
#include "volume/import/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "volume/error.h"

namespace blockwalk {

InputFile::InputFile(const std::filesystem::path& path) : path_(path), name_(path.filename().string()) {
  // Without O_NONBLOCK, opening a pipe that nobody writes to would wait for ever.
  descriptor_ = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor_ < 0) failData("{}: cannot be opened: {}", path.string(), std::strerror(errno));
  struct stat status {};
  const bool regular = fstat(descriptor_, &status) == 0 && S_ISREG(status.st_mode);
  if (!regular) {
    close(descriptor_);
    failData("{}: is not a regular file", path.string());
  }
  bytes_ = static_cast<std::uint64_t>(status.st_size);
}

InputFile::~InputFile() { close(descriptor_); }

ByteRange InputFile::dataFrom(std::uint64_t offset) const {
  const off_t begin = lseek(descriptor_, static_cast<off_t>(offset), SEEK_DATA);
  if (begin < 0 && errno == ENXIO) return {bytes_, bytes_};
  if (begin < 0) return {offset, bytes_};
  const off_t end = lseek(descriptor_, begin, SEEK_HOLE);
  return {static_cast<std::uint64_t>(begin), end < 0 ? bytes_ : static_cast<std::uint64_t>(end)};
}

std::size_t InputFile::readSome(std::uint64_t offset, std::span<std::byte> out) const {
  std::size_t done = 0;
  while (done < out.size()) {
    const std::uint64_t position = offset + done;
    const ssize_t got = pread(descriptor_, out.data() + done, out.size() - done, static_cast<off_t>(position));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) failData("{}: reading at byte {} failed: {}", name_, position, std::strerror(errno));
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  return done;
}

void InputFile::read(std::uint64_t offset, std::span<std::byte> out) const {
  const std::size_t got = readSome(offset, out);
  if (got != out.size()) {
    failData("{}: the file ends at byte {}, byte {} was asked for", name_, offset + got, offset + out.size());
  }
}

std::shared_ptr<const InputFile> openDataFile(const InputFile& header, const std::string& field,
                                              const std::string& name) {
  const std::filesystem::path given(name);
  if (given.empty() || given.is_absolute() || std::find(given.begin(), given.end(), "..") != given.end()) {
    failData("{}: {} '{}' must be a name inside the header's own folder", header.name(), field, name);
  }
  std::error_code failure;
  const auto folder = std::filesystem::canonical(std::filesystem::absolute(header.path()).parent_path(), failure);
  const auto file = failure ? given : std::filesystem::canonical(folder / given, failure);
  if (failure) failData("{}: {} '{}' cannot be opened: {}", header.name(), field, name, failure.message());
  const auto relative = file.lexically_relative(folder);
  if (relative.empty() || *relative.begin() == "..") {
    failData("{}: {} '{}' leads out of the header's own folder", header.name(), field, name);
  }
  return std::make_shared<InputFile>(file);
}

}  // namespace blockwalk
