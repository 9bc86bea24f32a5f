// SPDX-License-Identifier: Apache-2.0
#include "bench/experiments/codec_trip.h"

#include <turbojpeg.h>
#include <webp/decode.h>

#include <chrono>

#include "bench/experiments/record.h"
#include "volume/error.h"

namespace blockwalk::bench {
namespace {

std::vector<std::uint32_t> decodedJpeg(const Frame& frame, const std::vector<std::byte>& file) {
  std::vector<std::uint32_t> pixels(frame.pixels.size());
  const tjhandle decoder = tjInitDecompress();
  const int result = tjDecompress2(
      decoder, reinterpret_cast<const unsigned char*>(file.data()), static_cast<unsigned long>(file.size()),
      reinterpret_cast<unsigned char*>(pixels.data()), frame.width, 0, frame.height, TJPF_RGBA, TJFLAG_ACCURATEDCT);
  tjDestroy(decoder);
  if (result != 0) throw DataError("the JPEG that was written cannot be read");
  return pixels;
}

std::vector<std::uint32_t> decodedWebp(const Frame& frame, const std::vector<std::byte>& file) {
  std::vector<std::uint32_t> pixels(frame.pixels.size());
  const auto* decoded =
      WebPDecodeRGBAInto(reinterpret_cast<const std::uint8_t*>(file.data()), file.size(),
                         reinterpret_cast<std::uint8_t*>(pixels.data()), 4 * pixels.size(), 4 * frame.width);
  if (decoded == nullptr) throw DataError("the WebP that was written cannot be read");
  return pixels;
}

}  // namespace

CodecTrip throughCodec(const Frame& frame, ImageFormat format, int quality, int repeats) {
  std::vector<std::byte> file;
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    file = encodeImage(frame, format, quality);
    times.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
  }
  return {.pixels = format == ImageFormat::webp ? decodedWebp(frame, file) : decodedJpeg(frame, file),
          .bytes = file.size(),
          .encode_ms = median(times)};
}

}  // namespace blockwalk::bench
