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
#include <vector>

#include "volume/error.h"
#include "volume/import/input_file.h"
#include "volume/import/slices/tiff_file.h"

namespace blockwalk {

struct TiffFile::Decoder {
  Decoder(const std::filesystem::path& path, std::uint64_t memory) : file(path), memory_bytes(memory) {}
  ~Decoder() {
    if (tiff != nullptr) TIFFClose(tiff);
  }

  void open();
  void readPages();
  void addPages(TiffPage first);
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
  char message[240] = "";
  TIFF* tiff = nullptr;
  std::vector<TiffPage> pages;
  std::string description;
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
