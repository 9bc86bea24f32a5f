// SPDX-License-Identifier: Apache-2.0
// A file in memory that has a name, so that thousands of runs do not touch the disk.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdlib>
#include <string>

namespace blockwalk {

// Owns the descriptor; what cannot be done ends the program, as no input is to blame.
class MemoryFile {
 public:
  MemoryFile() : descriptor_(memfd_create("input", MFD_CLOEXEC)) {
    if (descriptor_ < 0) std::abort();
  }
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

  // The file holds these bytes and nothing else.
  void fill(const void* data, std::size_t size) const {
    const auto length = static_cast<off_t>(size);
    if (ftruncate(descriptor_, length) != 0 || pwrite(descriptor_, data, size, 0) != length) std::abort();
  }

  std::string contents() const {
    std::string bytes(static_cast<std::size_t>(lseek(descriptor_, 0, SEEK_END)), '\0');
    if (pread(descriptor_, bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) std::abort();
    return bytes;
  }

 private:
  int descriptor_;
};

}  // namespace blockwalk
