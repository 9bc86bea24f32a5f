// SPDX-License-Identifier: Apache-2.0
// The pages of a TIFF file, decoded in bands of rows.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "volume/import/convert/sample.h"

namespace blockwalk {

// How many pixels there are a unit of length, as the tags say it; 0: they do not.
struct TiffResolution {
  double x = 0;
  double y = 0;
  int unit = 2;  // ResolutionUnit: 1 none, 2 inch, 3 centimetre
};

// A directory that holds several slices is several pages.
struct TiffPage {
  std::uint64_t offset = 0;  // of its directory in the file
  int number = 0;            // of the directory, counted from 1
  int slice = 0;             // of the directory
  int depth = 1;             // how many there are: ImageDepth
  int width = 0;             // as it is stored
  int height = 0;
  int orientation = 0;    // where its first row and column lie: the tag's 1..8; 0: it does not say
  int bits = 0;           // of a sample in the file: 1..16, 32 or 64
  SampleFormat format;    // what readRow() gives
  bool inverted = false;  // WhiteIsZero
  bool palette = false;
  bool premultiplied = false;
  bool planes_apart = false;
  bool tiled = false;
  int piece_width = 0;   // a tile's, or the image's
  int piece_height = 0;  // a tile's, or a strip's
  int piece_depth = 1;   // a tile's
  // Not 0: where the samples of the slice begin, raw and row after row.
  std::uint64_t raw_offset = 0;
  TiffResolution resolution;
  // Of a coarser level: pixels of the finest one to one of its own, along a row as it is seen and along a column.
  glm::dvec2 shrunk{1};

  // As it is seen: rows from the top, columns from the left.
  int seenWidth() const { return orientation > 4 ? height : width; }
  int seenHeight() const { return orientation > 4 ? width : height; }
};

// Strips and tiles, both planar configurations, classic and BigTIFF, tiles of several slices. Grey of 1 to 64 bits,
// half floats, grey with alpha, RGB and RGBA of up to 16 bits, palettes as RGB. WhiteIsZero is turned round,
// premultiplied colour is divided by its alpha, rows and columns come as they are seen. Reduced copies of pages are
// their coarser levels; masks are passed over. libtiff's errors become DataError, also where it would go on with what
// it has; every allocation is checked against `memory_bytes` or the file before.
class TiffFile {
 public:
  // `level` 0 is the finest. Throws DataError for one that the file has not.
  TiffFile(const std::filesystem::path& path, std::uint64_t memory_bytes, int level = 0);
  ~TiffFile();
  TiffFile(const TiffFile&) = delete;
  TiffFile& operator=(const TiffFile&) = delete;

  const std::string& name() const;
  // Of the level; numbers and places are those of the finest one's.
  const std::vector<TiffPage>& pages() const;
  // How many all pages have.
  int levels() const;
  // The first page of directory `number`, counted from 0 and with those that are passed over; nothing where it is none.
  std::optional<std::size_t> pageOfDirectory(std::int64_t number) const;
  // Makes the only page the first of `count` that follow it raw, as ImageJ writes what a directory cannot address.
  // Throws DataError, naming `field`, where they do not lie so or the file is too short.
  void takePlanes(std::int64_t count, const std::string& field);
  // ImageDescription of the first page, which speaks for all; empty where there is none. Throws DataError where there
  // was no memory for it.
  const std::string& description() const;
  // Row `y` of a page, as it is seen, as samples of page.format; ascending rows decode every band once.
  void readRow(std::size_t page, int y, std::span<std::byte> out);

 private:
  struct Decoder;
  std::unique_ptr<Decoder> decoder_;
};

}  // namespace blockwalk
