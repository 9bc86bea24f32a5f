// SPDX-License-Identifier: Apache-2.0
// The pages of a TIFF file, decoded in bands of rows.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "volume/import/convert/sample.h"

namespace blockwalk {

struct TiffPage {
  std::uint64_t offset = 0;  // of its directory in the file
  int number = 0;            // counted from 1
  int width = 0;
  int height = 0;
  int bits = 0;           // of a sample in the file: 1, 2, 4, 8, 16, 32 or 64
  SampleFormat format;    // what readRow() gives
  bool inverted = false;  // WhiteIsZero
  bool palette = false;
  bool premultiplied = false;
  bool planes_apart = false;
  bool tiled = false;
  int piece_width = 0;   // a tile's, or the image's
  int piece_height = 0;  // a tile's, or a strip's
};

// Strips and tiles, both planar configurations, classic and BigTIFF. Grey of 1 to 64 bits, grey with alpha, RGB and
// RGBA of 8 and 16 bits, palettes as RGB. WhiteIsZero is turned round, premultiplied colour is divided by its alpha.
// Rows come in the order in which they lie in the file, whatever the orientation tag says. Thumbnails and masks among
// the pages are passed over. libtiff's errors become DataError, also where it would go on with what it has; every
// allocation is checked against `memory_bytes` or the file before.
class TiffFile {
 public:
  TiffFile(const std::filesystem::path& path, std::uint64_t memory_bytes);
  ~TiffFile();
  TiffFile(const TiffFile&) = delete;
  TiffFile& operator=(const TiffFile&) = delete;

  const std::string& name() const;
  const std::vector<TiffPage>& pages() const;
  // ImageDescription of the first page, which speaks for all; empty where there is none. Throws DataError where there
  // was no memory for it.
  const std::string& description() const;
  // Row `y` of a page as samples of page.format; ascending rows decode every band once.
  void readRow(std::size_t page, int y, std::span<std::byte> out);

 private:
  struct Decoder;
  std::unique_ptr<Decoder> decoder_;
};

}  // namespace blockwalk
