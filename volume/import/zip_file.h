// SPDX-License-Identifier: Apache-2.0
// The entries of a zip file (APPNOTE.TXT, with zip64), by their names.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "volume/import/input_file.h"

namespace blockwalk {

struct ZipEntry {
  std::uint64_t header = 0;  // offset of the local header
  std::uint64_t packed_bytes = 0;
  std::uint64_t bytes = 0;
  int method = 0;  // 0 stored, 8 deflated; -1 encrypted
};

class ZipFile {
 public:
  // Throws DataError for a file without a directory, and for one of more than `most_directory_bytes`.
  ZipFile(std::shared_ptr<const InputFile> file, std::uint64_t most_directory_bytes);

  const std::string& name() const { return file_->name(); }
  const std::shared_ptr<const InputFile>& file() const { return file_; }
  // No folders.
  const std::map<std::string, ZipEntry>& entries() const { return entries_; }

  // Where the bytes of the entry begin in the file, packed or not; all of them are there. Throws DataError naming
  // `named`, also where its method is neither stored nor deflated.
  std::uint64_t begin(const ZipEntry& entry, const std::string& named) const;
  // All of it, unpacked. Throws DataError where it is longer than `most_bytes` or unpacks to another length.
  std::vector<std::byte> unpack(const ZipEntry& entry, const std::string& named, std::uint64_t most_bytes) const;
  // The same piece by piece, of any length.
  void unpack(const ZipEntry& entry, const std::string& named,
              const std::function<void(std::span<const std::byte>)>& write) const;

 private:
  std::shared_ptr<const InputFile> file_;
  std::map<std::string, ZipEntry> entries_;
};

}  // namespace blockwalk
