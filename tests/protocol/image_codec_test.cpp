// SPDX-License-Identifier: Apache-2.0
#include "protocol/image_codec.h"

#include <gtest/gtest.h>
#include <png.h>
#include <turbojpeg.h>
#include <webp/decode.h>

#include <cmath>
#include <cstring>
#include <limits>

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

struct DecodedWebp {
  bool has_opacity = false;
  int width = 0;
  int height = 0;
  std::vector<std::uint32_t> pixels;
};

DecodedWebp decodeWebp(const std::vector<std::byte>& bytes) {
  const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
  WebPBitstreamFeatures features{};
  EXPECT_EQ(WebPGetFeatures(data, bytes.size(), &features), VP8_STATUS_OK);
  DecodedWebp decoded{.has_opacity = features.has_alpha != 0,
                      .width = features.width,
                      .height = features.height,
                      .pixels = std::vector<std::uint32_t>(static_cast<std::size_t>(features.width) *
                                                           static_cast<std::size_t>(features.height))};
  auto* out = reinterpret_cast<std::uint8_t*>(decoded.pixels.data());
  EXPECT_NE(WebPDecodeRGBAInto(data, bytes.size(), out, decoded.pixels.size() * 4, features.width * 4), nullptr);
  return decoded;
}

// Root of the mean square over colour channels, 8-bit steps.
double colorError(const std::vector<std::uint32_t>& found, const std::vector<std::uint32_t>& truth) {
  EXPECT_EQ(found.size(), truth.size());
  double sum = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    for (int shift = 0; shift < 24; shift += 8) {
      const int difference = static_cast<int>(found[i] >> shift & 0xff) - static_cast<int>(truth[i] >> shift & 0xff);
      sum += difference * difference;
    }
  }
  return std::sqrt(sum / (3 * static_cast<double>(truth.size())));
}

TEST(ImageCodec, WebpOfQuality100IsLossless) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 70}, {8192, 1}, {300, 200}}) {
    for (bool opaque : {true, false}) {
      const Frame frame = gradientFrame(width, height, opaque);
      const DecodedWebp decoded = decodeWebp(encodeImage(frame, ImageFormat::webp, 100));
      EXPECT_EQ(decoded.width, width);
      EXPECT_EQ(decoded.height, height);
      EXPECT_EQ(decoded.pixels, frame.pixels);
      EXPECT_EQ(decoded.has_opacity, !opaque);
    }
  }
}

TEST(ImageCodec, WebpIsCloserWithMoreQuality) {
  Frame frame = gradientFrame(300, 200, true);
  for (std::size_t i = 0; i < frame.pixels.size(); ++i) frame.pixels[i] ^= (i * 2654435761u >> 27 & 15u) * 0x010101u;
  double last_error = 1e9;
  std::size_t last_size = 0;
  for (int quality : {1, 20, 50, 85, 99, 100}) {
    const auto bytes = encodeImage(frame, ImageFormat::webp, quality);
    const double error = colorError(decodeWebp(bytes).pixels, frame.pixels);
    EXPECT_LT(error, last_error) << quality;
    EXPECT_TRUE(quality == 100 || bytes.size() > last_size) << quality;
    last_error = error;
    last_size = bytes.size();
  }
  EXPECT_EQ(last_error, 0);
}

TEST(ImageCodec, WebpKeepsOpacityAtEveryQuality) {
  for (int quality : {1, 35, 85}) {
    const Frame frame = gradientFrame(300, 20, false);
    const DecodedWebp decoded = decodeWebp(encodeImage(frame, ImageFormat::webp, quality));
    ASSERT_TRUE(decoded.has_opacity);
    for (std::size_t i = 0; i < frame.pixels.size(); ++i) ASSERT_EQ(decoded.pixels[i] >> 24, frame.pixels[i] >> 24);
    EXPECT_FALSE(decodeWebp(encodeImage(gradientFrame(30, 20, true), ImageFormat::webp, quality)).has_opacity);
  }
}

TEST(ImageCodec, WebpTakesTheNarrowestAndTheWidest) {
  for (const auto& [width, height] : {std::pair{1, 1}, {8192, 1}, {1, 8192}}) {
    const Frame frame = gradientFrame(width, height, true);
    const DecodedWebp decoded = decodeWebp(encodeImage(frame, ImageFormat::webp, 85));
    EXPECT_EQ(decoded.width, width);
    EXPECT_EQ(decoded.height, height);
    EXPECT_LT(colorError(decoded.pixels, frame.pixels), 3);
  }
}

TEST(ImageCodec, AQualityThatIsNoneIsRefused) {
  const Frame frame = gradientFrame(8, 8, true);
  for (ImageFormat format : {ImageFormat::jpeg, ImageFormat::webp}) {
    for (int quality : {-1, 0, 101, 1000}) EXPECT_THROW(encodeImage(frame, format, quality), DataError) << quality;
  }
}

TEST(ImageCodec, RawIsTheRows) {
  const Frame frame = gradientFrame(5, 4, false);
  const auto bytes = encodeImage(frame, ImageFormat::raw, 85);
  ASSERT_EQ(bytes.size(), 80u);
  EXPECT_EQ(std::memcmp(bytes.data(), frame.pixels.data(), bytes.size()), 0);
  EXPECT_EQ(static_cast<const void*>(rawBytes(frame).data()), frame.pixels.data());
  EXPECT_EQ(rawBytes(frame).size(), 80u);
}

Frame valuesFrame(Output output, int width, int height, std::vector<float> values) {
  Frame frame{.width = width, .height = height, .pixels = {}, .probes = {}, .stats = {}};
  frame.output = output;
  frame.values = std::move(values);
  frame.values_min = {2, -1, 0};
  frame.values_max = {6, 1, 4};
  return frame;
}

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

TEST(ImageCodec, DepthIsGreyOf16BitsBetweenNearAndFar) {
  const Frame frame = valuesFrame(Output::depth, 3, 2, {2, 4, 6, kInfinity, 1, 9});
  const auto bytes = encodeImage(frame, ImageFormat::png, 85);
  ASSERT_GT(bytes.size(), 26u);
  EXPECT_EQ(static_cast<int>(bytes[24]), 16);  // bit depth and colour type of the header
  EXPECT_EQ(static_cast<int>(bytes[25]), PNG_COLOR_TYPE_GRAY);
  // libpng's simplified reading takes 16-bit grey as linear light: read by hand.
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  struct Rest {
    const std::byte* at;
  } rest{bytes.data()};
  png_set_read_fn(png, &rest, [](png_structp reader, png_bytep out, png_size_t size) {
    auto* from = static_cast<Rest*>(png_get_io_ptr(reader));
    std::memcpy(out, from->at, size);
    from->at += size;
  });
  png_read_info(png, info);
  std::vector<int> found;
  for (int y = 0; y < 2; ++y) {
    png_byte row[6];
    png_read_row(png, row, nullptr);
    for (int x = 0; x < 3; ++x) found.push_back(row[2 * x] << 8 | row[2 * x + 1]);
  }
  png_destroy_read_struct(&png, &info, nullptr);
  EXPECT_EQ(found, (std::vector<int>{1, 32768, 65535, 0, 1, 65535}));
}

TEST(ImageCodec, DepthIsGreyOf8BitsInJpeg) {
  const Frame frame = valuesFrame(Output::depth, 16, 16, std::vector<float>(256, 4));
  int subsampling = -1;
  const std::uint32_t pixel = decodeJpeg(encodeImage(frame, ImageFormat::jpeg, 95), subsampling).at(7);
  for (int shift = 0; shift < 24; shift += 8) EXPECT_NEAR(static_cast<int>(pixel >> shift & 0xff), 128, 1);
}

TEST(ImageCodec, NumbersInWebpAreThePicturesOfThem) {
  const Frame depth = valuesFrame(Output::depth, 3, 1, {2, 4, kInfinity});
  EXPECT_EQ(decodeWebp(encodeImage(depth, ImageFormat::webp, 100)).pixels,
            (std::vector<std::uint32_t>{0xff000000u, 0xff808080u, 0xff000000u}));
  const Frame position = valuesFrame(Output::position, 2, 1, {6, -1, 2, kNan, kNan, kNan});
  EXPECT_EQ(decodeWebp(encodeImage(position, ImageFormat::webp, 100)).pixels,
            (std::vector<std::uint32_t>{0xff8000ffu, 0}));
}

TEST(ImageCodec, ValueIsGreyOverTheRange) {
  const Frame frame = valuesFrame(Output::value, 5, 1, {2, 6, kNan, 1, 7});
  EXPECT_EQ(decodeWebp(encodeImage(frame, ImageFormat::webp, 100)).pixels,
            (std::vector<std::uint32_t>{0xff000000u, 0xffffffffu, 0xff000000u, 0xff000000u, 0xffffffffu}));
}

TEST(ImageCodec, PositionIsColoredByTheBoxAndClearWhereThereIsNothing) {
  const Frame frame = valuesFrame(Output::position, 2, 1, {6, -1, 2, kNan, kNan, kNan});
  const DecodedPng decoded = decodePng(encodeImage(frame, ImageFormat::png, 85));
  EXPECT_EQ(decoded.pixels, (std::vector<std::uint32_t>{0xff8000ffu, 0}));
}

TEST(ImageCodec, CostIsColoredByItsLogarithm) {
  const Frame frame = valuesFrame(Output::cost, 7, 1, {0, 31, 255, 2047, 16383, 1e9F, 7});
  const DecodedPng decoded = decodePng(encodeImage(frame, ImageFormat::png, 85));
  const std::vector<std::uint32_t> stops{0xff000000u, 0xff6e0f57u, 0xff4040dbu, 0xff1fa6fcu, 0xffd9fffcu, 0xffd9fffcu};
  EXPECT_EQ(std::vector<std::uint32_t>(decoded.pixels.begin(), decoded.pixels.end() - 1), stops);
  EXPECT_EQ(decoded.pixels.back(), 0xff420934u);  // three fifths of the way to violet
}

TEST(ImageCodec, QueriesAreColoredAsCostOnAScaleOfTheirOwn) {
  const Frame frame = valuesFrame(Output::queries, 6, 1, {0, 3, 15, 63, 255, 1e9F});
  EXPECT_EQ(decodePng(encodeImage(frame, ImageFormat::png, 85)).pixels,
            (std::vector<std::uint32_t>{0xff000000u, 0xff6e0f57u, 0xff4040dbu, 0xff1fa6fcu, 0xffd9fffcu, 0xffd9fffcu}));
}

TEST(ImageCodec, RawValuesAreFloats) {
  for (const auto& [output, channels] : {std::pair{Output::depth, 1},
                                         {Output::position, 3},
                                         {Output::value, 1},
                                         {Output::cost, 1},
                                         {Output::queries, 1}}) {
    const Frame frame = valuesFrame(output, 2, 1, std::vector<float>(static_cast<std::size_t>(2 * channels), 0.1F));
    const auto bytes = encodeImage(frame, ImageFormat::raw, 85);
    ASSERT_EQ(bytes.size(), frame.values.size() * 4);
    EXPECT_EQ(std::memcmp(bytes.data(), "\xcd\xcc\xcc\x3d", 4), 0);
    EXPECT_EQ(rawPixel(output).channels, channels);
    EXPECT_EQ(rawPixel(output).type, "f32");
  }
  for (Output picture : {Output::color, Output::mesh}) {
    EXPECT_EQ(rawPixel(picture).channels, 4);
    EXPECT_EQ(rawPixel(picture).type, "u8");
  }
}

TEST(ImageCodecDeathTest, AnIncompleteFrameIsAProgrammersError) {
  Frame frame = gradientFrame(5, 4, true);
  frame.pixels.pop_back();
  EXPECT_DEATH(encodeImage(frame, ImageFormat::png, 85), "check failed");
}

}  // namespace
}  // namespace blockwalk
