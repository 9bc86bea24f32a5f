// SPDX-License-Identifier: Apache-2.0
// Where a build keeps what does not fit in memory, and how its result gets its name.
// Everything here throws std::system_error that names the path.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace blockwalk {

// Bytes appended at the end and read anywhere. What exceeds the buffer goes to a file in `folder` that has no name, so
// nothing is left however the process ends. Small content never touches the disk.
class TempBytes {
 public:
  TempBytes(std::filesystem::path folder, std::size_t buffer_bytes);
  ~TempBytes();
  TempBytes(TempBytes&& other) noexcept;
  TempBytes& operator=(TempBytes&&) = delete;

  void append(std::span<const std::byte> bytes);
  // [offset, offset + out.size()) must have been appended.
  void read(std::uint64_t offset, std::span<std::byte> out) const;
  std::uint64_t size() const { return flushed_ + buffer_.size(); }
  // Forgets the content and keeps the file.
  void clear();

 private:
  void flush();

  std::filesystem::path folder_;
  std::size_t buffer_bytes_;
  std::vector<std::byte> buffer_;
  std::uint64_t flushed_ = 0;
  int descriptor_ = -1;
};

// A file that appears under `path` whole or not at all: written as .NAME.partial-XXXXXXXX in the same folder, synced
// and renamed by commit(), removed by the destructor otherwise. Who is killed leaves the partial file; the next to
// write `path` removes it. Whose partial file is still being written is told by a lock on it; where the file system has
// no locks that cannot be told, and nothing is removed.
class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  // What is not written is zeros.
  void setLength(std::uint64_t bytes);
  void write(std::uint64_t offset, std::span<const std::byte> bytes);
  // What was written.
  void read(std::uint64_t offset, std::span<std::byte> out) const;
  // The disk begins with what was written so far, so that commit() does not wait for all of it; what fails is
  // commit()'s to see. May run beside write().
  void beginSync() const;
  // Partial files of `path` that somebody else may be writing or have left behind: locks say nothing here.
  const std::vector<std::filesystem::path>& leftovers() const { return leftovers_; }
  const std::filesystem::path& path() const { return path_; }
  // Where it is until commit().
  const std::filesystem::path& partialPath() const { return partial_; }
  void commit();

 private:
  std::filesystem::path path_;
  std::filesystem::path partial_;
  std::vector<std::filesystem::path> leftovers_;
  int descriptor_ = -1;
};

// Names of what becomes `path` once it is complete, in the same folder: .NAME.partial-XXXXXXXX.
std::string partialName(const std::filesystem::path& path, std::uint32_t number);
bool isPartialName(const std::string& name, const std::filesystem::path& path);

// The folder that holds `path`: "." for a bare name.
std::filesystem::path folderOf(const std::filesystem::path& path);

}  // namespace blockwalk
