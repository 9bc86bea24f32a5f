// SPDX-License-Identifier: Apache-2.0
#include "protocol/image_codec.h"

#include <png.h>
#include <turbojpeg.h>

#include <algorithm>
#include <csetjmp>
#include <cstring>
#include <memory>

#include "volume/error.h"

namespace blockwalk {
namespace {

constexpr int kPngLevel = 2;
constexpr int kFullChromaQuality = 90;

struct PngOutput {
  std::vector<std::byte> bytes;
  const char* error = nullptr;
};

// No exception may cross libpng's C frames: what fails here is kept and libpng jumps back to writePng.
void appendPng(png_structp png, png_bytep data, png_size_t size) {
  auto* output = static_cast<PngOutput*>(png_get_io_ptr(png));
  bool appended = true;
  try {
    const auto* begin = reinterpret_cast<const std::byte*>(data);
    output->bytes.insert(output->bytes.end(), begin, begin + size);
  } catch (...) {
    appended = false;
  }
  if (!appended) png_error(png, "out of memory");
}

void flushPng(png_structp) {}

void failPng(png_structp png, png_const_charp message) {
  auto* output = static_cast<PngOutput*>(png_get_error_ptr(png));
  // libpng's own messages are literals; anything else would not outlive the jump.
  output->error = std::strcmp(message, "out of memory") == 0 ? "out of memory" : "libpng refused the image";
  longjmp(*png_set_longjmp_fn(png, longjmp, sizeof(jmp_buf)), 1);
}

void ignoreWarning(png_structp, png_const_charp) {}

// Only trivially destructible locals here: libpng leaves by longjmp. `row` holds one row of the written format.
bool writePng(PngOutput& output, const Frame& frame, bool opaque, png_byte* row) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &output, failPng, ignoreWarning);
  if (png == nullptr) return false;
  png_infop info = png_create_info_struct(png);
  if (info == nullptr || setjmp(png_jmpbuf(png))) {
    png_destroy_write_struct(&png, &info);
    return false;
  }
  png_set_write_fn(png, &output, appendPng, flushPng);
  const auto width = static_cast<png_uint_32>(frame.width);
  png_set_IHDR(png, info, width, static_cast<png_uint_32>(frame.height), 8,
               opaque ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_RGBA, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(png, kPngLevel);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_write_info(png, info);
  const std::uint32_t* pixel = frame.pixels.data();
  const int channels = opaque ? 3 : 4;
  for (int y = 0; y < frame.height; ++y) {
    png_byte* out = row;
    for (int x = 0; x < frame.width; ++x, ++pixel, out += channels) {
      for (int channel = 0; channel < channels; ++channel) {
        out[channel] = static_cast<png_byte>(*pixel >> (8 * channel) & 0xff);
      }
    }
    png_write_row(png, row);
  }
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  return true;
}

bool isOpaque(const Frame& frame) {
  return std::all_of(frame.pixels.begin(), frame.pixels.end(), [](std::uint32_t pixel) { return pixel >> 24 == 255; });
}

std::vector<std::byte> encodePng(const Frame& frame) {
  const bool opaque = isOpaque(frame);
  std::vector<png_byte> row(static_cast<std::size_t>(frame.width) * 4);
  PngOutput output;
  if (!writePng(output, frame, opaque, row.data())) {
    failData("png: {}", output.error != nullptr ? output.error : "libpng could not start");
  }
  return std::move(output.bytes);
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

std::vector<std::byte> encodeJpeg(const Frame& frame, int quality) {
  const std::unique_ptr<void, JpegDelete> compressor(tjInitCompress());
  if (!compressor) failData("jpeg: libturbojpeg could not start");
  unsigned char* allocated = nullptr;
  unsigned long size = 0;
  const int subsampling = quality >= kFullChromaQuality ? TJSAMP_444 : TJSAMP_420;
  std::vector<std::uint32_t> composited;
  if (!isOpaque(frame)) {
    composited.resize(frame.pixels.size());
    std::transform(frame.pixels.begin(), frame.pixels.end(), composited.begin(), overBlack);
  }
  const auto& source = composited.empty() ? frame.pixels : composited;
  const auto* pixels = reinterpret_cast<const unsigned char*>(source.data());
  const int failed = tjCompress2(compressor.get(), pixels, frame.width, frame.width * 4, frame.height, TJPF_RGBX,
                                 &allocated, &size, subsampling, quality, TJFLAG_FASTDCT);
  const std::unique_ptr<unsigned char, JpegFree> bytes(allocated);
  if (failed != 0) failData("jpeg: {}", tjGetErrorStr2(compressor.get()));
  const auto* begin = reinterpret_cast<const std::byte*>(bytes.get());
  return {begin, begin + size};
}

std::vector<std::byte> encodeRaw(const Frame& frame) {
  std::vector<std::byte> bytes(frame.pixels.size() * sizeof(std::uint32_t));
  std::memcpy(bytes.data(), frame.pixels.data(), bytes.size());
  return bytes;
}

}  // namespace

std::vector<std::byte> encodeImage(const Frame& frame, ImageFormat format, int quality) {
  const auto pixels = static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
  BLOCKWALK_CHECK(frame.pixels.size(), ==, pixels);
  switch (format) {
    case ImageFormat::png:
      return encodePng(frame);
    case ImageFormat::jpeg:
      return encodeJpeg(frame, quality);
    case ImageFormat::raw:
      return encodeRaw(frame);
  }
  failData("format: no such image format");
}

std::string_view imageMimeType(ImageFormat format) {
  switch (format) {
    case ImageFormat::png:
      return "image/png";
    case ImageFormat::jpeg:
      return "image/jpeg";
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
    case ImageFormat::raw:
      return "raw";
  }
  return "";
}

}  // namespace blockwalk
