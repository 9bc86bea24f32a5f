// SPDX-License-Identifier: Apache-2.0
// A regular file open for reading at any offset, whose length is known.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

namespace blockwalk {

// Bytes from `begin` up to and without `end`.
struct ByteRange {
  std::uint64_t begin = 0;
  std::uint64_t end = 0;
};

// Move-only owner of a file descriptor. Throws DataError for whatever cannot be opened or is not a regular file (a
// pipe, a device, a folder), so that no read blocks and no length is a lie.
class InputFile {
 public:
  explicit InputFile(const std::filesystem::path& path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  // file name without folders, for messages
  const std::string& name() const { return name_; }
  const std::filesystem::path& path() const { return path_; }
  std::uint64_t bytes() const { return bytes_; }
  int descriptor() const { return descriptor_; }

  // The first bytes from `offset` on that are no hole; both ends the file's where there are none. All of it where the
  // file system knows no holes. From several threads at a time.
  ByteRange dataFrom(std::uint64_t offset) const;
  // Fills `out` from `offset`, or throws DataError that names the offset.
  void read(std::uint64_t offset, std::span<std::byte> out) const;
  // Reads what there is of out.size() bytes; returns how many.
  std::size_t readSome(std::uint64_t offset, std::span<std::byte> out) const;

 private:
  std::filesystem::path path_;
  std::string name_;
  std::uint64_t bytes_ = 0;
  int descriptor_ = -1;
};

// The file that a header names, beside the header or in a folder below it. Throws DataError naming `field` for an
// absolute name, one with `..`, and one that a symbolic link leads out of the header's folder.
std::shared_ptr<const InputFile> openDataFile(const InputFile& header, const std::string& field,
                                              const std::string& name);

}  // namespace blockwalk
