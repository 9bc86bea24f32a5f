// SPDX-License-Identifier: Apache-2.0
#include "protocol/image_codec.h"

#include <gtest/gtest.h>
#include <png.h>
#include <turbojpeg.h>

#include <cmath>
#include <cstring>

namespace blockwalk {
namespace {

Frame gradientFrame(int width, int height, bool opaque) {
  Frame frame{.width = width, .height = height, .pixels = {}, .probes = {}, .stats = {}};
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto red = static_cast<std::uint32_t>(255 * x / width);
      const auto green = static_cast<std::uint32_t>(255 * y / height);
      const std::uint32_t opacity = opaque ? 255u : static_cast<std::uint32_t>(x % 256);
      frame.pixels.push_back(red | green << 8 | 99u << 16 | opacity << 24);
    }
  }
  return frame;
}

struct DecodedPng {
  bool has_opacity = false;
  int width = 0;
  std::vector<std::uint32_t> pixels;
};

DecodedPng decodePng(const std::vector<std::byte>& bytes) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  EXPECT_TRUE(png_image_begin_read_from_memory(&image, bytes.data(), bytes.size())) << image.message;
  DecodedPng decoded{.has_opacity = (image.format & PNG_FORMAT_FLAG_ALPHA) != 0,
                     .width = static_cast<int>(image.width),
                     .pixels = std::vector<std::uint32_t>(std::size_t{image.width} * image.height)};
  image.format = PNG_FORMAT_RGBA;
  EXPECT_TRUE(png_image_finish_read(&image, nullptr, decoded.pixels.data(), 0, nullptr)) << image.message;
  return decoded;
}

TEST(ImageCodec, PngIsLosslessAndLeavesOpacityOutWhereAllIsOpaque) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 70}, {513, 3}, {300, 200}}) {
    const Frame opaque = gradientFrame(width, height, true);
    const DecodedPng decoded = decodePng(encodeImage(opaque, ImageFormat::png, 85));
    EXPECT_EQ(decoded.pixels, opaque.pixels);
    EXPECT_EQ(decoded.width, width);
    EXPECT_FALSE(decoded.has_opacity);
    const Frame clear = gradientFrame(width, height, false);
    const DecodedPng with_opacity = decodePng(encodeImage(clear, ImageFormat::png, 85));
    EXPECT_EQ(with_opacity.pixels, clear.pixels);
    EXPECT_TRUE(with_opacity.has_opacity);
  }
}

std::vector<std::uint32_t> decodeJpeg(const std::vector<std::byte>& bytes, int& subsampling) {
  tjhandle decompressor = tjInitDecompress();
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  int width = 0, height = 0, colors = 0;
  EXPECT_EQ(tjDecompressHeader3(decompressor, data, bytes.size(), &width, &height, &subsampling, &colors), 0);
  std::vector<std::uint32_t> pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  auto* out = reinterpret_cast<unsigned char*>(pixels.data());
  EXPECT_EQ(tjDecompress2(decompressor, data, bytes.size(), out, width, 0, height, TJPF_RGBA, 0), 0);
  tjDestroy(decompressor);
  return pixels;
}

TEST(ImageCodec, JpegIsCloseAndQualityCosts) {
  const Frame frame = gradientFrame(300, 200, true);
  int subsampling = -1;
  const auto low = encodeImage(frame, ImageFormat::jpeg, 20);
  const auto high = encodeImage(frame, ImageFormat::jpeg, 95);
  EXPECT_LT(low.size(), high.size());
  decodeJpeg(low, subsampling);
  EXPECT_EQ(subsampling, TJSAMP_420);
  const auto pixels = decodeJpeg(high, subsampling);
  EXPECT_EQ(subsampling, TJSAMP_444);
  ASSERT_EQ(pixels.size(), frame.pixels.size());
  int largest = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    for (int shift = 0; shift < 24; shift += 8) {
      const int a = static_cast<int>(pixels[i] >> shift & 0xff);
      const int b = static_cast<int>(frame.pixels[i] >> shift & 0xff);
      largest = std::max(largest, std::abs(a - b));
    }
  }
  EXPECT_LE(largest, 12);
}

TEST(ImageCodec, JpegIsCompositedOverBlack) {
  Frame frame{.width = 32, .height = 32, .pixels = {}, .probes = {}, .stats = {}};
  for (const auto& [pixel, shown] :
       {std::pair{0x00ffffffu, 0x000000u}, {0x80c86432u, 0x643219u}, {0xffc86432u, 0xc86432u}}) {
    frame.pixels.assign(1024, pixel);
    int subsampling = -1;
    const std::uint32_t found = decodeJpeg(encodeImage(frame, ImageFormat::jpeg, 95), subsampling).at(500);
    for (int shift = 0; shift < 24; shift += 8) {
      EXPECT_NEAR(static_cast<int>(found >> shift & 0xff), static_cast<int>(shown >> shift & 0xff), 3) << pixel;
    }
  }
}

TEST(ImageCodec, RawIsTheRows) {
  const Frame frame = gradientFrame(5, 4, false);
  const auto bytes = encodeImage(frame, ImageFormat::raw, 85);
  ASSERT_EQ(bytes.size(), 80u);
  EXPECT_EQ(std::memcmp(bytes.data(), frame.pixels.data(), bytes.size()), 0);
}

TEST(ImageCodecDeathTest, AnIncompleteFrameIsAProgrammersError) {
  Frame frame = gradientFrame(5, 4, true);
  frame.pixels.pop_back();
  EXPECT_DEATH(encodeImage(frame, ImageFormat::png, 85), "check failed");
}

}  // namespace
}  // namespace blockwalk
