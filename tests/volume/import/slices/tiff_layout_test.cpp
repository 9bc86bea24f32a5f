// SPDX-License-Identifier: Apache-2.0
// How pixels lie in a TIFF file: orientation, odd numbers of bits, half floats, several slices a directory.
#include <functional>

#include "tests/volume/import/slices/tiff_writer.h"

namespace blockwalk {
namespace {

using testing::AllOf;
using testing::HasSubstr;

// The stored page as somebody sees it whose first row and column are where the tag says.
std::string seen(const PageKind& kind, const std::string& stored) {
  const int o = kind.orientation;
  const auto pixel = static_cast<std::size_t>(kind.samples * kind.bits / 8);
  const bool turned = o > 4;
  const int width = turned ? kind.height : kind.width;
  const int height = turned ? kind.width : kind.height;
  std::string result;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      int row = turned ? x : y;
      int column = turned ? y : x;
      if (o == 3 || o == 4 || o == 6 || o == 7) row = kind.height - 1 - row;
      if (o == 2 || o == 3 || o == 7 || o == 8) column = kind.width - 1 - column;
      result += stored.substr(static_cast<std::size_t>(row * kind.width + column) * pixel, pixel);
    }
  }
  return result;
}

TEST(ImportTiffLayout, RowsAndColumnsAreAsTheyAreSeen) {
  const Scratch scratch;
  for (int orientation = 1; orientation <= 8; ++orientation) {
    for (const int tile : {0, 16}) {
      for (const int samples : {1, 4}) {
        const PageKind kind{.bits = samples == 1 ? 16 : 8,
                            .samples = samples,
                            .photometric = samples == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB,
                            .tile = tile,
                            .orientation = orientation};
        const auto file = writeTiff(scratch, kind, 2);
        const auto source = openSource({file}, {});
        EXPECT_EQ(source->info().dims, orientation > 4 ? glm::ivec3(18, 20, 2) : glm::ivec3(20, 18, 2));
        EXPECT_EQ(readAll(*source), seen(kind, pixelsOf(kind, 0)) + seen(kind, pixelsOf(kind, 1)))
            << orientation << " " << tile;
      }
    }
  }
  // Tagged on the first page alone, as many writers do.
  const PageKind first{.orientation = 4};
  TIFF* tiff = TIFFOpen(scratch.path("first.tif").c_str(), "w");
  for (int page = 0; page < 2; ++page) {
    setFields(tiff, page == 0 ? first : PageKind{});
    writeRows(tiff, first, page);
    TIFFWriteDirectory(tiff);
  }
  TIFFClose(tiff);
  EXPECT_EQ(importAll(scratch.path("first.tif")), seen(first, pixelsOf(first, 0)) + seen(first, pixelsOf(first, 1)));
  const PageKind large{.width = 300, .height = 300, .rows_per_strip = 1, .orientation = 6};
  ImportOptions little;
  little.memory_bytes = 50000;
  EXPECT_THAT(refusal({writeTiff(scratch, large)}, little), AllOf(HasSubstr("Orientation 6"), HasSubstr("--memory")));
}

TEST(ImportTiffLayout, AnyNumberOfBitsIsUnpacked) {
  const Scratch scratch;
  const PageKind twelve{.width = 3, .height = 1, .bits = 12};
  EXPECT_EQ(importAll(writePacked(scratch, twelve, std::string("\x12\x3f\xff\x00\x10", 5))),
            bytesOf<std::uint16_t>({0x123, 0xfff, 0x001}));
  const PageKind inverted{.width = 3, .height = 1, .bits = 12, .photometric = PHOTOMETRIC_MINISWHITE};
  EXPECT_EQ(importAll(writePacked(scratch, inverted, std::string("\x12\x3f\xff\x00\x10", 5))),
            bytesOf<std::uint16_t>({0xfff - 0x123, 0, 0xffe}));
  const PageKind three{.width = 5, .height = 1, .bits = 3};
  EXPECT_EQ(importAll(writePacked(scratch, three, std::string("\x05\x3e", 2))),  // 000 001 010 011 111
            bytesOf<std::uint8_t>({0, 1, 2, 3, 7}));
  const PageKind ten{.width = 1, .height = 1, .bits = 10, .samples = 3, .photometric = PHOTOMETRIC_RGB};
  ImportOptions fields;
  fields.channels = ChannelRule::fields;
  EXPECT_EQ(importAll(writePacked(scratch, ten, std::string("\x00\x60\x0f\xfc", 4)), fields),
            bytesOf<std::uint16_t>({1, 0x200, 0x3ff}));
}

TEST(ImportTiffLayout, HalfFloatsAreFloats) {
  const Scratch scratch;
  const PageKind kind{.width = 7, .height = 1, .bits = 16, .sample_format = SAMPLEFORMAT_IEEEFP};
  const std::string row = bytesOf<std::uint16_t>({0x3c00, 0xc000, 0x7bff, 0x0001, 0x8400, 0x7c00, 0x7e00});
  const auto source = openSource({writePacked(scratch, kind, row)}, {});
  EXPECT_EQ(source->info().type, VoxelType::f32);
  const std::string voxels = readAll(*source);
  EXPECT_EQ(voxels.substr(0, 20), bytesOf<float>({1, -2, 65504, std::ldexp(1.0f, -24), -std::ldexp(1.0f, -14)}));
  EXPECT_EQ(source->conversion(0).nonfinite_voxels, 2u);
}

// ImageJ's files beyond 4 GB have one directory, and the planes behind its own.
TEST(ImportTiffLayout, PlanesBehindOneDirectoryAreRead) {
  const Scratch scratch;
  for (const char* mode : {"wl", "wb"}) {
    const PageKind kind{.bits = 16, .description = "ImageJ=1.53t\nimages=3\nslices=3\n"};
    const auto file = writeTiff(scratch, kind, 1, mode);
    std::ifstream stream(file, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(stream), {}};
    TIFF* tiff = TIFFOpen(file.c_str(), "r");
    const auto begin = TIFFGetStrileOffset(tiff, 0);
    TIFFClose(tiff);
    // The strips are the last of what was written but for the directory, which is moved behind all planes.
    const std::string first = pixelsOf(kind, 0);
    const bool is_big = std::string_view(mode) == "wb";
    const auto planes = [&](int page) { return is_big ? swapped(pixelsOf(kind, page), 2) : pixelsOf(kind, page); };
    ASSERT_EQ(bytes.substr(begin, first.size()), planes(0));
    const std::size_t end = begin + first.size();
    EXPECT_THAT(refusal({file}), AllOf(HasSubstr("images=3"), HasSubstr("the file has")));
    std::string moved = bytes;
    const auto shift = static_cast<std::uint32_t>(2 * first.size());
    if (end < bytes.size()) {
      // Offsets behind the strips move with what is there: the directory's place, and those of its values.
      const auto put = [&](std::size_t at) {
        std::uint32_t value = 0;
        std::memcpy(&value, &moved[at], 4);
        if (is_big) value = __builtin_bswap32(value);
        if (value >= end) value += shift;
        if (is_big) value = __builtin_bswap32(value);
        std::memcpy(&moved[at], &value, 4);
      };
      std::uint32_t directory = 0;
      std::memcpy(&directory, &bytes[4], 4);
      if (is_big) directory = __builtin_bswap32(directory);
      std::uint16_t count = 0;
      std::memcpy(&count, &bytes[directory], 2);
      if (is_big) count = __builtin_bswap16(count);
      for (std::size_t i = 0; i < count; ++i) {
        std::uint32_t number = 0;
        std::memcpy(&number, &bytes[directory + 2 + 12 * i + 4], 4);
        if (is_big) number = __builtin_bswap32(number);
        if (number > 1) put(directory + 2 + 12 * i + 8);
      }
      put(4);
      moved.insert(end, planes(1) + planes(2));
    }
    const auto whole = scratch.write("planes.tif", moved);
    EXPECT_EQ(openSource({whole}, {})->info().dims, glm::ivec3(20, 18, 3));
    EXPECT_EQ(importAll(whole), pixelsOf(kind, 0) + pixelsOf(kind, 1) + pixelsOf(kind, 2)) << mode;
  }
  const PageKind packed{.compression = COMPRESSION_LZW, .description = "ImageJ=1.53t\nimages=3\nslices=3\n"};
  EXPECT_THAT(refusal({writeTiff(scratch, packed)}), HasSubstr("one after the other, uncompressed"));
}

// Tiles of several slices, as SGI has them.
TEST(ImportTiffLayout, TilesOfSeveralSlicesAreRead) {
  const Scratch scratch;
  constexpr int kDepth = 5;
  constexpr int kTileDepth = 4;
  for (const int compression : {COMPRESSION_NONE, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_LZW}) {
    const PageKind kind{.bits = 16, .compression = compression, .tile = 16};
    TIFF* tiff = TIFFOpen(scratch.path("deep.tif").c_str(), "w");
    setFields(tiff, kind);
    TIFFSetField(tiff, TIFFTAG_IMAGEDEPTH, kDepth);
    TIFFSetField(tiff, TIFFTAG_TILEDEPTH, kTileDepth);
    for (int z0 = 0; z0 < kDepth; z0 += kTileDepth) {
      for (int y0 = 0; y0 < kind.height; y0 += 16) {
        for (int x0 = 0; x0 < kind.width; x0 += 16) {
          std::string tile(16 * 16 * kTileDepth * 2, '\0');
          for (std::size_t i = 0; i < tile.size() / 2; ++i) {
            const int x = static_cast<int>(i % 16);
            const int y = static_cast<int>(i / 16 % 16);
            putSample(tile, i, 16, sampleAt(z0 + static_cast<int>(i / 256), x0 + x, y0 + y, 0));
          }
          const auto number = TIFFComputeTile(tiff, static_cast<std::uint32_t>(x0), static_cast<std::uint32_t>(y0),
                                              static_cast<std::uint32_t>(z0), 0);
          if (compression == COMPRESSION_ADOBE_DEFLATE) tile = gzipped(tile, MAX_WBITS);
          TIFFWriteRawTile(tiff, number, tile.data(), static_cast<tmsize_t>(tile.size()));
        }
      }
    }
    TIFFClose(tiff);
    if (compression == COMPRESSION_LZW) {
      EXPECT_THAT(refusal({scratch.path("deep.tif")}), HasSubstr("ImageDepth 5 with Compression 5"));
      continue;
    }
    std::string expected;
    for (int z = 0; z < kDepth; ++z) expected += pixelsOf(kind, z);
    EXPECT_EQ(openSource({scratch.path("deep.tif")}, {})->info().dims, glm::ivec3(20, 18, kDepth));
    EXPECT_EQ(importAll(scratch.path("deep.tif")), expected);
  }
}

}  // namespace
}  // namespace blockwalk
