// SPDX-License-Identifier: Apache-2.0
#include "volume/file/file_content.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "volume/error.h"

namespace blockwalk {

FileContent::FileContent(const std::filesystem::path& path) : path_(path), name_(path.string()) {
  // Without O_NONBLOCK the open of a FIFO would wait for a writer.
  descriptor_ = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (descriptor_ < 0) failData("{}: cannot be opened: {}", name_, std::strerror(errno));
  try {
    struct stat status {};
    if (::fstat(descriptor_, &status) != 0) failData("{}: cannot be examined: {}", name_, std::strerror(errno));
    if (!S_ISREG(status.st_mode)) failData("{}: not a regular file", name_);
    bytes_ = static_cast<std::uint64_t>(status.st_size);
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
}

FileContent::~FileContent() { ::close(descriptor_); }

void FileContent::read(std::uint64_t offset, std::span<std::byte> out) const {
  std::size_t done = 0;
  while (done < out.size()) {
    const ssize_t count = ::pread(descriptor_, out.data() + done, out.size() - done, static_cast<off_t>(offset + done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) failData("{}: cannot be read at offset {}: {}", name_, offset + done, std::strerror(errno));
    if (count == 0) {
      failData("{}: ended at offset {} while it was read, but had {} bytes when it was opened", name_, offset + done,
               bytes_);
    }
    done += static_cast<std::size_t>(count);
  }
}

void FileContent::expect(std::uint64_t offset, std::uint64_t bytes) const noexcept {
  ::posix_fadvise(descriptor_, static_cast<off_t>(offset), static_cast<off_t>(bytes), POSIX_FADV_WILLNEED);
}

void FileContent::checkLength() const {
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) failData("{}: cannot be examined: {}", name_, std::strerror(errno));
  const auto now = static_cast<std::uint64_t>(status.st_size);
  if (now < bytes_) failData("{}: shrank from {} to {} bytes since it was opened", name_, bytes_, now);
}

}  // namespace blockwalk
