// SPDX-License-Identifier: Apache-2.0
// Bands of rows of a TIFF page, out of strips or tiles.
#include <algorithm>
#include <array>
#include <cstring>

#include "volume/import/inflate.h"
#include "volume/import/slices/tiff_decoder.h"
#include "volume/import/slices/tiff_page.h"

namespace blockwalk {

void TiffFile::Decoder::select(std::size_t wanted) {
  const TiffPage& chosen = pages[wanted];
  page = std::numeric_limits<std::size_t>::max();
  band = -1;
  turned.clear();
  message[0] = '\0';
  if (TIFFSetSubDirectory(tiff, chosen.offset) == 0) fail(chosen);
  readTiffPage(tiff, file.name(), chosen.number);  // sets the codec's colour mode for this directory again
  samples = chosen.palette ? 1 : chosen.format.channels;
  makeRoom(chosen);
  if (chosen.palette) readColors(chosen);
  page = wanted;
}

void TiffFile::Decoder::makeRoom(const TiffPage& chosen) {
  const auto bits = static_cast<std::uint64_t>(chosen.bits) * static_cast<std::uint64_t>(samples);
  const std::uint64_t band_row = (static_cast<std::uint64_t>(chosen.width) * bits + 7) / 8;
  const std::uint64_t piece_bits = chosen.planes_apart ? static_cast<std::uint64_t>(chosen.bits) : bits;
  const std::uint64_t piece_row = (static_cast<std::uint64_t>(chosen.piece_width) * piece_bits + 7) / 8;
  const std::uint64_t declared = chosen.tiled ? TIFFTileSize64(tiff) : TIFFStripSize64(tiff);
  const std::uint64_t height = static_cast<std::uint64_t>(chosen.piece_height);
  if (declared != piece_row * height) {
    failData("{}: page {}: a {} has {} bytes, {} were expected", file.name(), chosen.number,
             chosen.tiled ? "tile" : "strip", declared, piece_row * height);
  }
  std::uint16_t compression = COMPRESSION_NONE;
  TIFFGetFieldDefaulted(tiff, TIFFTAG_COMPRESSION, &compression);
  if (compression == COMPRESSION_NONE && piece_row * height > file.bytes()) {
    failData("{}: page {}: a {} has {} bytes, the file has {}", file.name(), chosen.number,
             chosen.tiled ? "tile" : "strip", piece_row * height, file.bytes());
  }
  const bool is_turned = chosen.orientation > 4;
  const std::uint64_t seen =
      static_cast<std::uint64_t>(chosen.width) * static_cast<std::uint64_t>(chosen.height) * chosen.format.voxelBytes();
  const std::uint64_t needed = (band_row + piece_row) * height + (is_turned ? seen : 0);
  if (needed > memory_bytes) {
    failData("{}: page {}: {} {} of memory, {} are allowed; raise --memory", file.name(), chosen.number,
             is_turned ? fmt::format("Orientation {}: the page takes", chosen.orientation)
                       : fmt::format("its {} take", chosen.tiled ? "tiles" : "strips"),
             fmt::format("{} bytes", needed), memory_bytes);
  }
  row_bytes = band_row;
  piece_row_bytes = piece_row;
  piece_bytes = piece_row * height;
  rows = std::make_unique<std::byte[]>(band_row * height);
  piece = std::make_unique<std::byte[]>(piece_bytes);
}

void TiffFile::Decoder::readColors(const TiffPage& chosen) {
  std::array<std::uint16_t*, 3> tables{};
  if (TIFFGetField(tiff, TIFFTAG_COLORMAP, &tables[0], &tables[1], &tables[2]) != 1) {
    failData("{}: page {}: ColorMap: the tag is missing", file.name(), chosen.number);
  }
  const std::size_t entries = std::size_t{1} << chosen.bits;
  colors.resize(entries * 3);
  for (std::size_t i = 0; i < entries * 3; ++i) colors[i] = tables[i % 3][i / 3];
  // Old writers put 8-bit values into the 16-bit table.
  const bool narrow = std::all_of(colors.begin(), colors.end(), [](std::uint16_t value) { return value < 256; });
  for (std::uint16_t& value : colors) value = static_cast<std::uint16_t>(narrow ? value * 257 : value);
}

void TiffFile::Decoder::swapBytes(std::span<std::byte> bytes) const {
  const auto width = static_cast<std::size_t>(pages[page].bits) / 8;
  if (TIFFIsByteSwapped(tiff) == 0 || width < 2) return;
  for (std::size_t i = 0; i + width <= bytes.size(); i += width) std::reverse(&bytes[i], &bytes[i] + width);
}

void TiffFile::Decoder::readRawBand(int index, int row_count) {
  const std::uint64_t first = static_cast<std::uint64_t>(index) * static_cast<std::uint64_t>(pages[page].piece_height);
  const std::span<std::byte> band_rows(rows.get(), row_bytes * static_cast<std::size_t>(row_count));
  file.read(pages[page].raw_offset + first * row_bytes, band_rows);
  swapBytes(band_rows);
}

// libtiff gives the first slice of a tile alone.
void TiffFile::Decoder::readDeepTile(std::uint32_t tile) {
  const TiffPage& chosen = pages[page];
  const auto within = static_cast<std::uint64_t>(chosen.slice % chosen.piece_depth) * piece_bytes;
  const std::uint64_t offset = TIFFGetStrileOffset(tiff, tile);
  const std::span<std::byte> samples_of_piece(piece.get(), piece_bytes);
  std::uint16_t compression = COMPRESSION_NONE;
  TIFFGetFieldDefaulted(tiff, TIFFTAG_COMPRESSION, &compression);
  if (compression == COMPRESSION_NONE) {
    if (TIFFGetStrileByteCount(tiff, tile) < within + piece_bytes) fail(chosen);
    file.read(offset + within, samples_of_piece);
  } else {
    InflateStream stream(std::shared_ptr<const InputFile>(std::shared_ptr<void>(), &file), offset);
    if (stream.skip(within) != within || stream.read(samples_of_piece) != piece_bytes) fail(chosen);
  }
  swapBytes(samples_of_piece);
}

void TiffFile::Decoder::readPiece(int index, int column, int plane, int row_count) {
  const TiffPage& chosen = pages[page];
  const auto row = static_cast<std::uint32_t>(index * chosen.piece_height);
  message[0] = '\0';
  std::memset(piece.get(), 0, piece_bytes);
  tmsize_t wanted = static_cast<tmsize_t>(piece_bytes);
  tmsize_t got = 0;
  if (chosen.tiled) {
    const std::uint32_t tile =
        TIFFComputeTile(tiff, static_cast<std::uint32_t>(column * chosen.piece_width), row,
                        static_cast<std::uint32_t>(chosen.slice), static_cast<std::uint16_t>(plane));
    if (chosen.depth > 1) return readDeepTile(tile);
    got = TIFFReadEncodedTile(tiff, tile, piece.get(), wanted);
  } else {
    wanted = static_cast<tmsize_t>(piece_row_bytes) * row_count;
    const std::uint32_t strip = TIFFComputeStrip(tiff, row, static_cast<std::uint16_t>(plane));
    got = TIFFReadEncodedStrip(tiff, strip, piece.get(), wanted);
  }
  // Some decoders report an error and fill what is left with whatever was there.
  if (got != wanted || message[0] != '\0') fail(chosen);
}

void TiffFile::Decoder::copyPiece(int column, int plane, int row_count) {
  const TiffPage& chosen = pages[page];
  const std::size_t sample = static_cast<std::size_t>(chosen.bits) / 8;
  const int first = column * chosen.piece_width;
  const int pixels = std::min(chosen.piece_width, chosen.width - first);
  for (int y = 0; y < row_count; ++y) {
    const std::byte* from = piece.get() + static_cast<std::size_t>(y) * piece_row_bytes;
    std::byte* row = rows.get() + static_cast<std::size_t>(y) * row_bytes;
    if (!chosen.planes_apart) {
      const auto bits = static_cast<std::size_t>(chosen.bits) * static_cast<std::size_t>(samples);
      std::memcpy(row + static_cast<std::size_t>(first) * bits / 8, from,
                  (static_cast<std::size_t>(pixels) * bits + 7) / 8);
      continue;
    }
    std::byte* to =
        row + (static_cast<std::size_t>(first) * static_cast<std::size_t>(samples) + static_cast<std::size_t>(plane)) *
                  sample;
    for (int x = 0; x < pixels; ++x, from += sample, to += sample * static_cast<std::size_t>(samples)) {
      std::memcpy(to, from, sample);
    }
  }
}

void TiffFile::Decoder::decodeBand(int index) {
  const TiffPage& chosen = pages[page];
  const int row_count = std::min(chosen.piece_height, chosen.height - index * chosen.piece_height);
  const int columns = chosen.tiled ? (chosen.width + chosen.piece_width - 1) / chosen.piece_width : 1;
  const int planes = chosen.planes_apart ? samples : 1;
  band = -1;
  if (chosen.raw_offset > 0) {
    readRawBand(index, row_count);
    band = index;
    return;
  }
  for (int column = 0; column < columns; ++column) {
    for (int plane = 0; plane < planes; ++plane) {
      readPiece(index, column, plane, row_count);
      copyPiece(column, plane, row_count);
    }
  }
  band = index;
}

}  // namespace blockwalk
