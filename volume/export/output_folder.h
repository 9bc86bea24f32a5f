// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace blockwalk {

// A folder that appears under `path` whole or not at all: filled as .NAME.partial-XXXXXXXX beside it, renamed by
// commit(), removed with what is in it by the destructor otherwise. Who is killed leaves it; the next to write `path`
// removes it, unless a lock says that it is still being written or the file system has none. Throws DataError where
// something is there already, std::system_error for the disk.
class OutputFolder {
 public:
  explicit OutputFolder(const std::filesystem::path& path);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  // Where it is until commit().
  const std::filesystem::path& partialPath() const { return partial_; }
  void commit();

 private:
  std::filesystem::path path_;
  std::filesystem::path partial_;
  int lock_ = -1;
};

}  // namespace blockwalk
