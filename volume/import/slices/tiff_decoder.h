// SPDX-License-Identifier: Apache-2.0
// What a TiffFile holds: libtiff's handle, the pages, and the band of one page that was decoded last.
#pragma once

#include <tiffio.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/import/input_file.h"
#include "volume/import/slices/tiff_file.h"

namespace blockwalk {

struct TiffFile::Decoder {
  Decoder(const std::filesystem::path& path, std::uint64_t memory, int wanted_level)
      : file(path), memory_bytes(memory), level(wanted_level) {}
  ~Decoder() {
    if (tiff != nullptr) TIFFClose(tiff);
  }

  void open();
  void readPages();
  void addPages(TiffPage first);
  void noteCoarser();
  void chooseLevel();
  std::uint64_t coarserOf(std::size_t wanted) const;
  void takePlanes(std::int64_t count, const std::string& field);
  void select(std::size_t page);
  void makeRoom(const TiffPage& chosen);
  void readColors(const TiffPage& chosen);
  void decodeBand(int index);
  void readRawBand(int index, int rows);
  void readPiece(int index, int column, int plane, int rows);
  void readDeepTile(std::uint32_t tile);
  void swapBytes(std::span<std::byte> samples) const;
  void readStoredRow(int y, std::span<std::byte> out);
  void readTurnedRow(int y, std::span<std::byte> out);
  void copyPiece(int column, int plane, int rows);
  void expandRow(const std::byte* packed, std::span<std::byte> out) const;
  [[noreturn]] void fail(const TiffPage& broken) const {
    failData("{}: page {}: {}", file.name(), broken.number, message[0] != '\0' ? message : "libtiff cannot read it");
  }

  InputFile file;
  std::uint64_t memory_bytes;
  int level;
  int levels = 1;
  char message[240] = "";
  TIFF* tiff = nullptr;
  std::vector<TiffPage> pages;
  std::string description;
  // How many SubIFDs all pages so far have; of each page where the directory of the level is.
  int sub_levels = std::numeric_limits<int>::max();
  std::vector<std::uint64_t> sub_directories;
  // Reduced copies that are pages of their own: where their directories are, and how many other pages lie before.
  std::vector<std::pair<std::uint64_t, std::size_t>> reduced;
  std::string no_description;  // why it was left out; empty: it was not

  // the band that is decoded
  std::size_t page = std::numeric_limits<std::size_t>::max();
  int band = -1;
  int samples = 1;            // in the file, a pixel
  std::size_t row_bytes = 0;  // of the band: samples of a pixel side by side, bits packed
  std::size_t piece_row_bytes = 0;
  std::size_t piece_bytes = 0;
  std::unique_ptr<std::byte[]> rows;
  std::unique_ptr<std::byte[]> piece;
  std::vector<std::uint16_t> colors;  // a palette's, RGB by entry
  std::vector<std::byte> turned;      // the stored rows of a page whose rows are seen as columns
};

}  // namespace blockwalk
