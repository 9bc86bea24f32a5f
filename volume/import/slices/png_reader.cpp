// SPDX-License-Identifier: Apache-2.0
#include "volume/import/slices/png_reader.h"

#include <png.h>

#include <algorithm>
#include <bit>
#include <csetjmp>
#include <cstring>
#include <memory>
#include <vector>

#include "volume/error.h"
#include "volume/import/input_file.h"

namespace blockwalk {
namespace {
constexpr std::uint32_t kMaxPngSide = std::uint32_t{1} << 24;  // a column of 65536 slices of 256 rows
constexpr png_alloc_size_t kMaxChunkBytes = png_alloc_size_t{1} << 24;
}  // namespace

// libpng reports errors by longjmp, so everything between setjmp and the jump is plain C: no object with a destructor
// lives there.
struct PngReader::Decoder {
  explicit Decoder(const std::filesystem::path& path) : file(path) {}
  ~Decoder() { png_destroy_read_struct(&png, info != nullptr ? &info : nullptr, nullptr); }

  template <typename Body>
  void guarded(Body&& body) {
    if (setjmp(png_jmpbuf(png)) == 0) {
      body();
      return;
    }
    failData("{}: PNG: {}", file.name(), message);
  }

  void begin();
  void readHeader();
  void readWhole(std::uint64_t memory_bytes);

  InputFile file;
  std::uint64_t position = 0;
  char message[200] = "";
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  int bit_depth = 0;
  int color_type = 0;
  int interlace = 0;
  int channels = 0;
  std::size_t row_bytes = 0;
  std::uint32_t next_row = 0;
  std::unique_ptr<std::byte[]> whole;  // interlaced: all rows
};

namespace {

extern "C" void onPngError(png_structp png, png_const_charp text) {
  char* message = static_cast<char*>(png_get_error_ptr(png));
  std::strncpy(message, text, 199);
  png_longjmp(png, 1);
}

extern "C" void onPngWarning(png_structp, png_const_charp) {}

}  // namespace

void PngReader::Decoder::begin() {
  png = png_create_read_struct(PNG_LIBPNG_VER_STRING, message, onPngError, onPngWarning);
  if (png == nullptr) failData("{}: PNG: the decoder cannot be made", file.name());
  info = png_create_info_struct(png);
  if (info == nullptr) failData("{}: PNG: the decoder cannot be made", file.name());
  png_set_user_limits(png, kMaxPngSide, kMaxPngSide);
  png_set_chunk_malloc_max(png, kMaxChunkBytes);
  png_set_read_fn(png, this, [](png_structp reader, png_bytep out, png_size_t count) {
    auto* decoder = static_cast<Decoder*>(png_get_io_ptr(reader));
    std::size_t got = 0;
    try {
      got = decoder->file.readSome(decoder->position, {reinterpret_cast<std::byte*>(out), count});
    } catch (const DataError&) {
      got = 0;
    }
    decoder->position += got;
    if (got != count) png_error(reader, "the file ends too early");
  });
}

void PngReader::Decoder::readHeader() {
  guarded([this] {
    png_read_info(png, info);
    png_get_IHDR(png, info, &width, &height, &bit_depth, &color_type, &interlace, nullptr, nullptr);
    if (png_get_valid(png, info, PNG_INFO_tRNS) != 0) png_set_tRNS_to_alpha(png);
    if (color_type == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png);
    if (bit_depth < 8) png_set_packing(png);
    if (bit_depth == 16 && std::endian::native == std::endian::little) png_set_swap(png);
    png_set_interlace_handling(png);
    png_read_update_info(png, info);
    bit_depth = png_get_bit_depth(png, info);
    channels = png_get_channels(png, info);
    row_bytes = png_get_rowbytes(png, info);
  });
}

void PngReader::Decoder::readWhole(std::uint64_t memory_bytes) {
  const std::uint64_t bytes = static_cast<std::uint64_t>(row_bytes) * height;
  if (bytes > memory_bytes) {
    failData("{}: an interlaced PNG is held whole: {} bytes of memory, {} are allowed; raise --memory", file.name(),
             bytes, memory_bytes);
  }
  whole = std::make_unique<std::byte[]>(bytes);
  guarded([this] {
    constexpr int kPasses = 7;
    for (int pass = 0; pass < kPasses; ++pass) {
      for (std::uint32_t row = 0; row < height; ++row) {
        png_read_row(png, reinterpret_cast<png_bytep>(whole.get() + row * row_bytes), nullptr);
      }
    }
    png_read_end(png, nullptr);
  });
}

PngReader::PngReader(const std::filesystem::path& path, std::uint64_t memory_bytes)
    : decoder_(std::make_unique<Decoder>(path)) {
  Decoder& decoder = *decoder_;
  decoder.begin();
  decoder.readHeader();
  // A row is held twice by libpng and once here.
  if (3 * std::uint64_t{decoder.row_bytes} > memory_bytes) {
    failData("{}: PNG: a row takes {} bytes, {} bytes of memory are allowed", decoder.file.name(), decoder.row_bytes,
             memory_bytes);
  }
  if (decoder.interlace != PNG_INTERLACE_NONE) decoder.readWhole(memory_bytes);
}

PngReader::~PngReader() = default;

int PngReader::width() const { return static_cast<int>(decoder_->width); }
int PngReader::height() const { return static_cast<int>(decoder_->height); }

SampleFormat PngReader::format() const {
  return {decoder_->bit_depth == 16 ? SampleType::u16 : SampleType::u8, decoder_->channels, false};
}

void PngReader::readRow(std::span<std::byte> out) {
  Decoder& decoder = *decoder_;
  BLOCKWALK_CHECK(out.size(), ==, decoder.row_bytes);
  BLOCKWALK_CHECK(decoder.next_row, <, decoder.height);
  const std::uint32_t row = decoder.next_row++;
  if (decoder.whole != nullptr) {
    std::memcpy(out.data(), decoder.whole.get() + row * decoder.row_bytes, decoder.row_bytes);
    return;
  }
  std::byte* target = out.data();
  decoder.guarded([&decoder, target, row] {
    png_read_row(decoder.png, reinterpret_cast<png_bytep>(target), nullptr);
    if (row + 1 == decoder.height) png_read_end(decoder.png, nullptr);
  });
}

}  // namespace blockwalk
