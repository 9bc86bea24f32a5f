// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <zlib.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "volume/build/storage.h"

namespace blockwalk {

// A gzip file that appears whole or not at all, as OutputFile has it. Throws std::system_error for the disk.
class GzipFile {
 public:
  explicit GzipFile(const std::filesystem::path& path);
  ~GzipFile();
  GzipFile(const GzipFile&) = delete;
  GzipFile& operator=(const GzipFile&) = delete;

  void write(std::span<const std::byte> bytes);
  // Returns the bytes of the file.
  std::uint64_t commit();

 private:
  void deflateAll(int flush);

  OutputFile file_;
  z_stream stream_{};
  std::vector<std::byte> packed_;
  std::uint64_t written_ = 0;
};

}  // namespace blockwalk
