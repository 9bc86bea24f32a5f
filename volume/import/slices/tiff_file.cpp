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
#include "volume/import/slices/tiff_decoder.h"
#include "volume/import/slices/tiff_page.h"
#include "volume/volume.h"

namespace blockwalk {

namespace {

void reversePixels(std::span<std::byte> row, std::size_t pixel) {
  for (std::size_t i = 0, j = row.size() - pixel; i < j; i += pixel, j -= pixel) {
    std::swap_ranges(&row[i], &row[i] + pixel, &row[j]);
  }
}

extern "C" int keepMessage(TIFF*, void* message, const char*, const char* format, va_list arguments) {
  std::vsnprintf(static_cast<char*>(message), 240, format, arguments);
  return 1;  // goes no further: libtiff would print it
}
extern "C" int dropMessage(TIFF*, void*, const char*, const char*, va_list) { return 1; }

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
      addPages(readTiffPage(tiff, file.name(), number));
    }
    noteCoarser();
    if (TIFFLastDirectory(tiff) != 0) break;
    message[0] = '\0';
    if (TIFFReadDirectory(tiff) == 0) {
      failData("{}: the page behind page {} cannot be read: {}", file.name(), number,
               message[0] != '\0' ? message : "its directory was met before");
    }
  }
  if (pages.empty()) failData("{}: TIFF: holds thumbnails and masks alone", file.name());
  chooseLevel();
}

// One for each slice of the directory, which libtiff still has at hand.
void TiffFile::Decoder::addPages(TiffPage first) {
  // Many writers tag the first page alone.
  if (first.orientation == 0 && !pages.empty()) first.orientation = pages.front().orientation;
  if (pages.size() + static_cast<std::size_t>(first.depth) > static_cast<std::size_t>(kMaxDim)) {
    failData("{}: TIFF: more than {} slices", file.name(), kMaxDim);
  }
  pages.push_back(first);
  if (first.depth == 1) return;
  if (!first.tiled) {
    pages.pop_back();
    std::vector<TiffPage> before = std::exchange(pages, {first});
    takePlanes(first.depth, fmt::format("ImageDepth {}", first.depth));
    before.insert(before.end(), pages.begin(), pages.end());
    pages = std::move(before);
    return;
  }
  std::uint16_t compression = COMPRESSION_NONE;
  std::uint16_t predictor = PREDICTOR_NONE;
  TIFFGetFieldDefaulted(tiff, TIFFTAG_COMPRESSION, &compression);
  const bool is_deflated = compression == COMPRESSION_ADOBE_DEFLATE || compression == COMPRESSION_DEFLATE;
  if (is_deflated) TIFFGetFieldDefaulted(tiff, TIFFTAG_PREDICTOR, &predictor);
  if ((compression != COMPRESSION_NONE && !is_deflated) || predictor != PREDICTOR_NONE || first.bits < 8) {
    failData("{}: page {}: ImageDepth {} with Compression {} and Predictor {} cannot be read", file.name(),
             first.number, first.depth, compression, predictor);
  }
  for (int slice = 1; slice < first.depth; ++slice) {
    pages.push_back(first);
    pages.back().slice = slice;
  }
}

void TiffFile::Decoder::takePlanes(std::int64_t count, const std::string& field) {
  const TiffPage first = pages.front();
  if (level > 0)
    failData("{}: {}: level {} is asked for, the slices of one directory have but one", file.name(), field, level);
  if (TIFFCurrentDirOffset(tiff) != first.offset && TIFFSetSubDirectory(tiff, first.offset) == 0) fail(first);
  std::uint16_t compression = COMPRESSION_NONE;
  TIFFGetFieldDefaulted(tiff, TIFFTAG_COMPRESSION, &compression);
  const bool is_raw = compression == COMPRESSION_NONE && !first.tiled && !first.planes_apart && first.bits >= 8 &&
                      first.bits % 8 == 0 && !first.palette;
  const std::uint64_t row = static_cast<std::uint64_t>(first.width) * static_cast<std::uint64_t>(first.bits / 8) *
                            static_cast<std::uint64_t>(first.format.channels);
  const std::uint64_t strip = row * static_cast<std::uint64_t>(first.piece_height);
  const std::uint64_t begin = TIFFGetStrileOffset(tiff, 0);
  bool follow = is_raw;
  const int strips = (first.height + first.piece_height - 1) / first.piece_height;
  for (int i = 1; i < strips && follow; ++i) {
    follow = TIFFGetStrileOffset(tiff, static_cast<std::uint32_t>(i)) == begin + strip * static_cast<std::uint64_t>(i);
  }
  if (pages.size() != 1 || !follow) {
    failData("{}: {}: the slices of one directory must lie one after the other, uncompressed", file.name(), field);
  }
  if (count > kMaxDim) failData("{}: {}: more than {} slices", file.name(), field, kMaxDim);
  const std::uint64_t plane = row * static_cast<std::uint64_t>(first.height);
  const std::uint64_t left = file.bytes() - std::min(file.bytes(), begin);
  if (begin == 0 || left / plane < static_cast<std::uint64_t>(count)) {
    failData("{}: {}: slices of {} bytes from byte {} on, the file has {} bytes", file.name(), field, plane, begin,
             file.bytes());
  }
  pages.clear();
  for (std::int64_t i = 0; i < count; ++i) {
    pages.push_back(first);
    pages.back().slice = static_cast<int>(i);
    pages.back().raw_offset = begin + static_cast<std::uint64_t>(i) * plane;
  }
}

TiffFile::TiffFile(const std::filesystem::path& path, std::uint64_t memory_bytes, int level)
    : decoder_(std::make_unique<Decoder>(path, memory_bytes, level)) {
  decoder_->open();
  decoder_->readPages();
}

TiffFile::~TiffFile() = default;

const std::string& TiffFile::name() const { return decoder_->file.name(); }
const std::vector<TiffPage>& TiffFile::pages() const { return decoder_->pages; }
int TiffFile::levels() const { return decoder_->levels; }
const std::string& TiffFile::description() const {
  if (!decoder_->no_description.empty()) {
    failData("{}: ImageDescription, or another field of the first page: {}; raise --memory", name(),
             decoder_->no_description);
  }
  return decoder_->description;
}

std::optional<std::size_t> TiffFile::pageOfDirectory(std::int64_t number) const {
  const auto& pages = decoder_->pages;
  const auto found = std::ranges::lower_bound(pages, number + 1, {}, &TiffPage::number);
  if (found == pages.end() || found->number != number + 1) return std::nullopt;
  return static_cast<std::size_t>(found - pages.begin());
}

void TiffFile::takePlanes(std::int64_t count, const std::string& field) { decoder_->takePlanes(count, field); }

void TiffFile::readRow(std::size_t page, int y, std::span<std::byte> out) {
  Decoder& decoder = *decoder_;
  const TiffPage& chosen = decoder.pages[page];
  const std::size_t pixel = chosen.format.voxelBytes();
  BLOCKWALK_CHECK(out.size(), ==, static_cast<std::size_t>(chosen.seenWidth()) * pixel);
  if (decoder.page != page) decoder.select(page);
  if (chosen.orientation > 4) return decoder.readTurnedRow(y, out);
  const bool from_bottom = chosen.orientation == 3 || chosen.orientation == 4;
  decoder.readStoredRow(from_bottom ? chosen.height - 1 - y : y, out);
  if (chosen.orientation == 2 || chosen.orientation == 3) reversePixels(out, pixel);
}

}  // namespace blockwalk
