// SPDX-License-Identifier: Apache-2.0
#include "protocol/image_codec.h"

#include <png.h>
#include <turbojpeg.h>
#include <webp/encode.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <csetjmp>
#include <cstdlib>
#include <memory>
#include <new>
#include <string_view>

#include "protocol/output_picture.h"
#include "volume/error.h"

namespace blockwalk {
namespace {

constexpr int kPngLevel = 1;
// Rendered pictures are mostly smaller by runs alone than by a fast search for matches, and sooner done
// (docs/experiments/lavapipe.md).
constexpr int kPngStrategy = Z_RLE;
constexpr int kFullChromaQuality = 90;
constexpr int kWebpMethod = 2;         // 0 (fastest) to 6; below 2 libwebp refuses large noisy pictures
constexpr int kWebpLosslessLevel = 1;  // 0 (fastest) to 9; 0 is no smaller than PNG

struct PngOutput {
  std::vector<std::byte> bytes;
  bool is_short_of_memory = false;
};

// libpng's and zlib's memory: that there was none is known here alone, whatever they make of it.
png_voidp allocatePng(png_structp png, png_alloc_size_t size) {
  void* memory = std::malloc(size);
  if (memory == nullptr) static_cast<PngOutput*>(png_get_mem_ptr(png))->is_short_of_memory = true;
  return memory;
}

void freePng(png_structp, png_voidp memory) { std::free(memory); }

// No exception may cross libpng's C frames: what fails here is kept and libpng jumps back to writePng.
void appendPng(png_structp png, png_bytep data, png_size_t size) {
  auto* output = static_cast<PngOutput*>(png_get_io_ptr(png));
  try {
    const auto* begin = reinterpret_cast<const std::byte*>(data);
    output->bytes.insert(output->bytes.end(), begin, begin + size);
  } catch (...) {
    output->is_short_of_memory = true;
  }
  if (output->is_short_of_memory) png_error(png, "out of memory");
}

void flushPng(png_structp) {}

void failPng(png_structp png, png_const_charp) { longjmp(*png_set_longjmp_fn(png, longjmp, sizeof(jmp_buf)), 1); }

void ignoreWarning(png_structp, png_const_charp) {}

struct PngShape {
  int width = 0;
  int height = 0;
  int bits = 8;
  int color_type = PNG_COLOR_TYPE_RGB;
};

// `fillRow(y, row)` writes a row of the format's bytes. Only trivially destructible locals here: libpng leaves by
// longjmp.
template <typename FillRow>
bool writePng(PngOutput& output, const PngShape& shape, const FillRow& fill_row, png_byte* row) {
  png_structp png =
      png_create_write_struct_2(PNG_LIBPNG_VER_STRING, nullptr, failPng, ignoreWarning, &output, allocatePng, freePng);
  if (png == nullptr) return false;
  png_infop info = png_create_info_struct(png);
  if (info == nullptr || setjmp(png_jmpbuf(png))) {
    png_destroy_write_struct(&png, &info);
    return false;
  }
  png_set_write_fn(png, &output, appendPng, flushPng);
  png_set_IHDR(png, info, static_cast<png_uint_32>(shape.width), static_cast<png_uint_32>(shape.height), shape.bits,
               shape.color_type, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(png, kPngLevel);
  png_set_compression_strategy(png, kPngStrategy);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_write_info(png, info);
  for (int y = 0; y < shape.height; ++y) {
    fill_row(y, row);
    png_write_row(png, row);
  }
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return true;
}

using Pixels = std::span<const std::uint32_t>;

bool isOpaque(Pixels pixels) {
  return std::ranges::all_of(pixels, [](std::uint32_t pixel) { return pixel >> 24 == 255; });
}

template <typename FillRow>
std::vector<std::byte> finishPng(const PngShape& shape, const FillRow& fill_row) {
  std::vector<png_byte> row(static_cast<std::size_t>(shape.width) * 4);
  PngOutput output;
  if (!writePng(output, shape, fill_row, row.data())) {
    if (output.is_short_of_memory) throw std::bad_alloc();
    failData("png: libpng refused the image");
  }
  return std::move(output.bytes);
}

std::vector<std::byte> encodePng(const Frame& frame, Pixels pixels) {
  const bool opaque = isOpaque(pixels);
  const std::size_t channels = opaque ? 3 : 4;
  const auto width = static_cast<std::size_t>(frame.width);
  const PngShape shape{.width = frame.width,
                       .height = frame.height,
                       .bits = 8,
                       .color_type = opaque ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_RGBA};
  return finishPng(shape, [&](int y, png_byte* out) {
    for (std::uint32_t pixel : pixels.subspan(static_cast<std::size_t>(y) * width, width)) {
      for (std::size_t channel = 0; channel < channels; ++channel) {
        *out++ = static_cast<png_byte>(pixel >> (8 * channel) & 0xff);
      }
    }
  });
}

// PNG is big endian.
std::vector<std::byte> encodeGreyPng(const Frame& frame) {
  const std::vector<std::uint16_t> picture = greyPicture(frame);
  const auto width = static_cast<std::size_t>(frame.width);
  const PngShape shape{.width = frame.width, .height = frame.height, .bits = 16, .color_type = PNG_COLOR_TYPE_GRAY};
  return finishPng(shape, [&](int y, png_byte* out) {
    for (std::uint16_t depth : std::span(picture).subspan(static_cast<std::size_t>(y) * width, width)) {
      *out++ = static_cast<png_byte>(depth >> 8);
      *out++ = static_cast<png_byte>(depth & 0xff);
    }
  });
}

struct JpegDelete {
  void operator()(void* compressor) const { tjDestroy(compressor); }
};
struct JpegFree {
  void operator()(unsigned char* bytes) const { tjFree(bytes); }
};

std::uint32_t overBlack(std::uint32_t pixel) {
  const std::uint32_t opacity = pixel >> 24;
  std::uint32_t out = 0xff000000u;
  for (int shift = 0; shift < 24; shift += 8) out |= ((pixel >> shift & 0xff) * opacity + 127) / 255 << shift;
  return out;
}

// "Memory allocation failure", "Insufficient memory (case 4)": it has no codes.
[[noreturn]] void failJpeg(std::string_view message) {
  if (message.find("emory") != std::string_view::npos) throw std::bad_alloc();
  failData("jpeg: {}", message);
}

std::vector<std::byte> encodeJpeg(const Frame& frame, Pixels source, int quality) {
  const std::unique_ptr<void, JpegDelete> compressor(tjInitCompress());
  if (!compressor) throw std::bad_alloc();  // it fails for nothing else
  unsigned char* allocated = nullptr;
  unsigned long size = 0;
  const int subsampling = quality >= kFullChromaQuality ? TJSAMP_444 : TJSAMP_420;
  std::vector<std::uint32_t> composited;
  if (!isOpaque(source)) {
    composited.resize(source.size());
    std::ranges::transform(source, composited.begin(), overBlack);
    source = composited;
  }
  const auto* pixels = reinterpret_cast<const unsigned char*>(source.data());
  const int failed = tjCompress2(compressor.get(), pixels, frame.width, frame.width * 4, frame.height, TJPF_RGBX,
                                 &allocated, &size, subsampling, quality, TJFLAG_FASTDCT);
  const std::unique_ptr<unsigned char, JpegFree> bytes(allocated);
  if (failed != 0) failJpeg(tjGetErrorStr2(compressor.get()));
  const auto* begin = reinterpret_cast<const std::byte*>(bytes.get());
  return {begin, begin + size};
}

struct WebpDelete {
  void operator()(WebPPicture* picture) const { WebPPictureFree(picture); }
};
struct WebpClear {
  void operator()(WebPMemoryWriter* writer) const { WebPMemoryWriterClear(writer); }
};

WebPConfig webpConfig(int quality) {
  WebPConfig config;
  if (WebPConfigInit(&config) == 0) failData("webp: this libwebp is not the one that was built against");
  if (quality == kLosslessWebp) {
    WebPConfigLosslessPreset(&config, kWebpLosslessLevel);
    config.exact = 1;  // colours without opacity too
  } else {
    config.quality = static_cast<float>(quality);
    config.method = kWebpMethod;
    config.alpha_filtering = 0;
  }
  return config;
}

[[noreturn]] void failWebp(WebPEncodingError error) {
  // WebPMemoryWrite fails for memory alone, and some allocations leave no error behind.
  for (const auto of_memory :
       {VP8_ENC_OK, VP8_ENC_ERROR_OUT_OF_MEMORY, VP8_ENC_ERROR_BITSTREAM_OUT_OF_MEMORY, VP8_ENC_ERROR_BAD_WRITE}) {
    if (error == of_memory) throw std::bad_alloc();
  }
  failData("webp: libwebp refused the image (error {})", static_cast<int>(error));
}

std::vector<std::byte> encodeWebp(const Frame& frame, Pixels pixels, int quality) {
  const WebPConfig config = webpConfig(quality);
  WebPPicture picture;
  if (WebPPictureInit(&picture) == 0) failData("webp: this libwebp is not the one that was built against");
  const std::unique_ptr<WebPPicture, WebpDelete> kept(&picture);
  WebPMemoryWriter writer;
  WebPMemoryWriterInit(&writer);
  const std::unique_ptr<WebPMemoryWriter, WebpClear> written(&writer);
  picture.width = frame.width;
  picture.height = frame.height;
  picture.use_argb = config.lossless;
  picture.writer = WebPMemoryWrite;
  picture.custom_ptr = &writer;
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(pixels.data());
  if (WebPPictureImportRGBA(&picture, bytes, frame.width * 4) == 0 || WebPEncode(&config, &picture) == 0) {
    failWebp(picture.error_code);
  }
  const auto* begin = reinterpret_cast<const std::byte*>(writer.mem);
  return {begin, begin + writer.size};
}

static_assert(std::endian::native == std::endian::little);

template <typename Value>
std::vector<std::byte> encodeRaw(std::span<const Value> values) {
  const auto bytes = std::as_bytes(values);
  return {bytes.begin(), bytes.end()};
}

std::vector<std::byte> encodeColor(const Frame& frame, Pixels pixels, ImageFormat format, int quality) {
  switch (format) {
    case ImageFormat::png:
      return encodePng(frame, pixels);
    case ImageFormat::jpeg:
      return encodeJpeg(frame, pixels, quality);
    case ImageFormat::webp:
      return encodeWebp(frame, pixels, quality);
    case ImageFormat::raw:
      return encodeRaw(pixels);
  }
  failData("format: no such image format");
}

}  // namespace

std::vector<std::byte> encodeImage(const Frame& frame, ImageFormat format, int quality) {
  if (quality < 1 || quality > 100) failData("quality: {} is not in 1..100", quality);
  const auto pixels = static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
  if (isPicture(frame.output)) {
    BLOCKWALK_CHECK(frame.pixels.size(), ==, pixels);
    return encodeColor(frame, frame.pixels, format, quality);
  }
  BLOCKWALK_CHECK(frame.values.size(), ==, pixels * static_cast<std::size_t>(rawPixel(frame.output).channels));
  if (format == ImageFormat::raw) return encodeRaw(std::span(frame.values));
  if (format == ImageFormat::png && isGrey(frame.output)) return encodeGreyPng(frame);
  return encodeColor(frame, outputPicture(frame), format, quality);
}

std::span<const std::byte> rawBytes(const Frame& frame) {
  static_assert(std::endian::native == std::endian::little);
  return isPicture(frame.output) ? std::as_bytes(std::span(frame.pixels)) : std::as_bytes(std::span(frame.values));
}

RawPixel rawPixel(Output output) {
  if (isPicture(output)) return {};
  return {.channels = output == Output::position ? 3 : 1, .type = "f32"};
}

std::string_view imageMimeType(ImageFormat format) {
  switch (format) {
    case ImageFormat::png:
      return "image/png";
    case ImageFormat::jpeg:
      return "image/jpeg";
    case ImageFormat::webp:
      return "image/webp";
    case ImageFormat::raw:
      return "application/octet-stream";
  }
  return "";
}

std::string_view imageFormatName(ImageFormat format) {
  switch (format) {
    case ImageFormat::png:
      return "png";
    case ImageFormat::jpeg:
      return "jpeg";
    case ImageFormat::webp:
      return "webp";
    case ImageFormat::raw:
      return "raw";
  }
  return "";
}

}  // namespace blockwalk
