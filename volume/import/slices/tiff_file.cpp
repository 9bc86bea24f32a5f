// SPDX-License-Identifier: Apache-2.0
#include "volume/import/slices/tiff_file.h"

#include <tiffio.h>
#include <unistd.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <limits>
#include <utility>

#include "volume/error.h"
#include "volume/import/input_file.h"
#include "volume/import/slices/tiff_page.h"
#include "volume/volume.h"

namespace blockwalk {

struct TiffFile::Decoder {
  Decoder(const std::filesystem::path& path, std::uint64_t memory) : file(path), memory_bytes(memory) {}
  ~Decoder() {
    if (tiff != nullptr) TIFFClose(tiff);
  }

  void open();
  void readPages();
  void select(std::size_t page);
  void decodeBand(int index);
  void readPiece(int index, int column, int plane, int rows);
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
};

namespace {

extern "C" int keepMessage(TIFF*, void* message, const char*, const char* format, va_list arguments) {
  std::vsnprintf(static_cast<char*>(message), 240, format, arguments);
  return 1;  // goes no further: libtiff would print it
}
extern "C" int dropMessage(TIFF*, void*, const char*, const char*, va_list) { return 1; }

// max - v is ~v for unsigned samples of every width
void invert(std::span<std::byte> samples) {
  for (std::byte& part : samples) part = ~part;
}

// Colour was multiplied by alpha; the quotient is rounded and never above full.
template <typename T>
void divideByAlpha(std::span<std::byte> row, std::size_t channels) {
  std::vector<T> pixel(channels);
  for (std::size_t i = 0; i + channels * sizeof(T) <= row.size(); i += channels * sizeof(T)) {
    std::memcpy(pixel.data(), &row[i], channels * sizeof(T));
    const std::uint64_t alpha = pixel.back();
    constexpr std::uint64_t kFull = std::numeric_limits<T>::max();
    for (std::size_t c = 0; c + 1 < channels && alpha > 0; ++c) {
      pixel[c] = static_cast<T>(std::min(kFull, (pixel[c] * kFull + alpha / 2) / alpha));
    }
    std::memcpy(&row[i], pixel.data(), channels * sizeof(T));
  }
}

}  // namespace

void TiffFile::Decoder::open() {
  const std::unique_ptr<TIFFOpenOptions, void (*)(TIFFOpenOptions*)> options(TIFFOpenOptionsAlloc(),
                                                                             TIFFOpenOptionsFree);
  const auto limit =
      std::min<std::uint64_t>(memory_bytes, static_cast<std::uint64_t>(std::numeric_limits<tmsize_t>::max()));
  TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), static_cast<tmsize_t>(limit));
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), keepMessage, message);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), dropMessage, nullptr);
  // m: not mapped, so that a file cut short while it is read is an error and no signal. O: strip tables when needed.
  const int descriptor = dup(file.descriptor());
  if (descriptor >= 0) tiff = TIFFFdOpenExt(descriptor, file.name().c_str(), "rmO", options.get());
  if (tiff == nullptr) {
    if (descriptor >= 0) close(descriptor);
    failData("{}: TIFF: {}", file.name(), message[0] != '\0' ? message : "cannot be opened");
  }
}

void TiffFile::Decoder::readPages() {
  for (int number = 1;; ++number) {
    if (number > kMaxDim) failData("{}: TIFF: more than {} pages", file.name(), kMaxDim);
    if (!isSecondaryPage(tiff)) {
      if (pages.empty()) {
        description = tiffDescription(tiff, file.name());
        // libtiff goes on without a field that it has no memory for, and does not say which.
        if (description.empty() && std::strstr(message, "memory") != nullptr) no_description = message;
      }
      pages.push_back(readTiffPage(tiff, file.name(), number));
    }
    if (TIFFLastDirectory(tiff) != 0) break;
    message[0] = '\0';
    if (TIFFReadDirectory(tiff) == 0) {
      failData("{}: the page behind page {} cannot be read: {}", file.name(), number,
               message[0] != '\0' ? message : "its directory was met before");
    }
  }
  if (pages.empty()) failData("{}: TIFF: holds thumbnails and masks alone", file.name());
}

void TiffFile::Decoder::select(std::size_t wanted) {
  const TiffPage& chosen = pages[wanted];
  page = std::numeric_limits<std::size_t>::max();
  band = -1;
  message[0] = '\0';
  if (TIFFSetSubDirectory(tiff, chosen.offset) == 0) fail(chosen);
  readTiffPage(tiff, file.name(), chosen.number);  // sets the codec's colour mode for this directory again
  samples = chosen.palette ? 1 : chosen.format.channels;
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
  const std::uint64_t needed = (band_row + piece_row) * height;
  if (needed > memory_bytes) {
    failData("{}: page {}: its {} take {} bytes of memory, {} are allowed; raise --memory", file.name(), chosen.number,
             chosen.tiled ? "tiles" : "strips", needed, memory_bytes);
  }
  row_bytes = band_row;
  piece_row_bytes = piece_row;
  piece_bytes = piece_row * height;
  rows = std::make_unique<std::byte[]>(band_row * height);
  piece = std::make_unique<std::byte[]>(piece_bytes);
  if (chosen.palette) {
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
  page = wanted;
}

void TiffFile::Decoder::readPiece(int index, int column, int plane, int row_count) {
  const TiffPage& chosen = pages[page];
  const auto row = static_cast<std::uint32_t>(index * chosen.piece_height);
  message[0] = '\0';
  std::memset(piece.get(), 0, piece_bytes);
  tmsize_t wanted = static_cast<tmsize_t>(piece_bytes);
  tmsize_t got = 0;
  if (chosen.tiled) {
    const std::uint32_t tile = TIFFComputeTile(tiff, static_cast<std::uint32_t>(column * chosen.piece_width), row, 0,
                                               static_cast<std::uint16_t>(plane));
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
  for (int column = 0; column < columns; ++column) {
    for (int plane = 0; plane < planes; ++plane) {
      readPiece(index, column, plane, row_count);
      copyPiece(column, plane, row_count);
    }
  }
  band = index;
}

void TiffFile::Decoder::expandRow(const std::byte* packed, std::span<std::byte> out) const {
  const TiffPage& chosen = pages[page];
  if (chosen.bits >= 8 && !chosen.palette) {
    std::memcpy(out.data(), packed, out.size());
    if (chosen.inverted) invert(out);
    const auto channels = static_cast<std::size_t>(chosen.format.channels);
    if (chosen.premultiplied && chosen.bits == 8) divideByAlpha<std::uint8_t>(out, channels);
    if (chosen.premultiplied && chosen.bits == 16) divideByAlpha<std::uint16_t>(out, channels);
    return;
  }
  const auto bits = static_cast<std::size_t>(chosen.bits);
  const unsigned full = (1u << bits) - 1;
  for (std::size_t x = 0; x < static_cast<std::size_t>(chosen.width); ++x) {
    const std::size_t bit = x * bits;
    const auto whole = std::to_integer<unsigned>(packed[bit / 8]);
    const unsigned value = whole >> (8 - bits - bit % 8) & full;
    if (chosen.palette) {
      std::memcpy(&out[x * 6], &colors[std::size_t{value} * 3], 6);
    } else {
      out[x] = static_cast<std::byte>(chosen.inverted ? full - value : value);
    }
  }
}

TiffFile::TiffFile(const std::filesystem::path& path, std::uint64_t memory_bytes)
    : decoder_(std::make_unique<Decoder>(path, memory_bytes)) {
  decoder_->open();
  decoder_->readPages();
}

TiffFile::~TiffFile() = default;

const std::string& TiffFile::name() const { return decoder_->file.name(); }
const std::vector<TiffPage>& TiffFile::pages() const { return decoder_->pages; }
const std::string& TiffFile::description() const {
  if (!decoder_->no_description.empty()) {
    failData("{}: ImageDescription, or another field of the first page: {}; raise --memory", name(),
             decoder_->no_description);
  }
  return decoder_->description;
}

void TiffFile::readRow(std::size_t page, int y, std::span<std::byte> out) {
  Decoder& decoder = *decoder_;
  const TiffPage& chosen = decoder.pages[page];
  BLOCKWALK_CHECK(out.size(), ==, static_cast<std::size_t>(chosen.width) * chosen.format.voxelBytes());
  if (decoder.page != page) decoder.select(page);
  if (decoder.band != y / chosen.piece_height) decoder.decodeBand(y / chosen.piece_height);
  decoder.expandRow(decoder.rows.get() + static_cast<std::size_t>(y % chosen.piece_height) * decoder.row_bytes, out);
}

}  // namespace blockwalk
