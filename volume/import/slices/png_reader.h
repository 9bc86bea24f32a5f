// SPDX-License-Identifier: Apache-2.0
// One PNG file, row by row.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "volume/import/convert/sample.h"

namespace blockwalk {

// Palettes become RGB (RGBA where entries are transparent), a transparent colour becomes alpha, 1, 2 and 4-bit grey
// keeps its numbers in u8. Colours are as stored: no gamma, no profile. Throws DataError for a broken file, and for an
// interlaced one that does not fit `memory_bytes`: that has to be held whole.
class PngReader {
 public:
  PngReader(const std::filesystem::path& path, std::uint64_t memory_bytes);
  ~PngReader();
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  int width() const;
  int height() const;
  SampleFormat format() const;  // of this machine's byte order
  // Samples of the next row, top row first: width * format().voxelBytes() bytes. At most height() calls.
  void readRow(std::span<std::byte> out);

 private:
  struct Decoder;
  std::unique_ptr<Decoder> decoder_;
};

}  // namespace blockwalk
