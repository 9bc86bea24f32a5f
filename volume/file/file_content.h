// SPDX-License-Identifier: Apache-2.0
// The bytes of a file that is open. Nothing is mapped: reading a page of a mapping that lies beyond the end of a file
// which was truncated meanwhile ends the process, and no check beforehand can be early enough.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace blockwalk {

// Owner of the descriptor; any thread may read. Everything throws DataError that names the file.
class FileContent {
 public:
  // Of a regular file, which no other is waited for.
  explicit FileContent(const std::filesystem::path& path);
  ~FileContent();
  FileContent(const FileContent&) = delete;
  FileContent& operator=(const FileContent&) = delete;

  const std::filesystem::path& path() const { return path_; }
  const std::string& name() const { return name_; }  // for messages
  std::uint64_t bytes() const { return bytes_; }     // when it was opened

  // Fills `out` from `offset` on. Throws when the file has no longer that many bytes, or cannot be read.
  void read(std::uint64_t offset, std::span<std::byte> out) const;
  // Says that these are about to be read, so that the disk brings them in meanwhile. Never fails: it is a word to the
  // system.
  void expect(std::uint64_t offset, std::uint64_t bytes) const noexcept;
  // Throws when the file is shorter than it was.
  void checkLength() const;

 private:
  std::filesystem::path path_;
  std::string name_;
  int descriptor_ = -1;
  std::uint64_t bytes_ = 0;
};

}  // namespace blockwalk
