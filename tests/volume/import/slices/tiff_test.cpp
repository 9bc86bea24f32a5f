// SPDX-License-Identifier: Apache-2.0
#include <sys/resource.h>
#include <sys/wait.h>
#include <tiffio.h>
#include <unistd.h>

#include <functional>

#include "tests/volume/import/import_scratch.h"
#include "tests/volume/import/slices/tiff_writer.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;

TEST(ImportTiff, ReadsEveryLayout) {
  const Scratch scratch;
  for (const int tile : {0, 16}) {
    for (const int compression : {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE}) {
      for (const char* mode : {"wl", "wb", "w8"}) {
        for (const int bits : {8, 16, 32}) {
          PageKind kind{.bits = bits, .compression = compression, .tile = tile};
          if (bits == 32) kind.sample_format = SAMPLEFORMAT_IEEEFP;
          EXPECT_EQ(importAll(writeTiff(scratch, kind, 2, mode)), pixelsOf(kind, 0) + pixelsOf(kind, 1))
              << tile << " " << compression << " " << mode << " " << bits;
        }
        for (const int planar : {PLANARCONFIG_CONTIG, PLANARCONFIG_SEPARATE}) {
          const PageKind kind{
              .samples = 4, .photometric = PHOTOMETRIC_RGB, .planar = planar, .compression = compression, .tile = tile};
          EXPECT_EQ(importAll(writeTiff(scratch, kind, 1, mode)), pixelsOf(kind, 0)) << tile << " " << planar;
        }
      }
    }
  }
}

TEST(ImportTiff, TurnsSignedAndInvertedSamples) {
  const Scratch scratch;
  const PageKind inverted{.photometric = PHOTOMETRIC_MINISWHITE};
  std::string expected = pixelsOf(inverted, 0);
  for (char& value : expected) value = static_cast<char>(~value);
  EXPECT_EQ(importAll(writeTiff(scratch, inverted)), expected);
  const PageKind with_sign{.bits = 16, .sample_format = SAMPLEFORMAT_INT};
  EXPECT_EQ(openSource({writeTiff(scratch, with_sign)}, {})->info().channels[0].value_offset, -32768);
}

TEST(ImportTiff, UnpacksBitsAndPalettes) {
  const Scratch scratch;
  const PageKind bits{.width = 10, .height = 1, .bits = 1};
  EXPECT_EQ(importAll(writePacked(scratch, bits, "\xa0\x40")), bytesOf<std::uint8_t>({1, 0, 1, 0, 0, 0, 0, 0, 0, 1}));
  const PageKind nibbles{.width = 3, .height = 1, .bits = 4};
  EXPECT_EQ(importAll(writePacked(scratch, nibbles, "\x0f\x70")), bytesOf<std::uint8_t>({0, 15, 7}));
  const PageKind indexed{.width = 2, .height = 1, .bits = 4, .photometric = PHOTOMETRIC_PALETTE};
  std::vector<std::uint16_t> red(16, 0), green(16, 0), blue(16, 0);
  red[1] = 255 * 257;
  green[2] = 10 * 257;
  const auto colors = [&](TIFF* tiff) { TIFFSetField(tiff, TIFFTAG_COLORMAP, red.data(), green.data(), blue.data()); };
  EXPECT_EQ(importAll(writePacked(scratch, indexed, "\x12", colors)),
            bytesOf<std::uint8_t>({255, 0, 0, 255, 0, 10, 0, 10}));
}

TEST(ImportTiff, DividesPremultipliedColour) {
  const Scratch scratch;
  const PageKind kind{
      .width = 2, .height = 1, .samples = 4, .photometric = PHOTOMETRIC_RGB, .alpha = EXTRASAMPLE_ASSOCALPHA};
  const std::string row = bytesOf<std::uint8_t>({64, 128, 0, 128, 9, 9, 9, 0});
  EXPECT_EQ(importAll(writePacked(scratch, kind, row)), bytesOf<std::uint8_t>({128, 255, 0, 128, 9, 9, 9, 0}));
}

// A G4 strip whose codes end early or are wrong: an error, or the same picture every time, never what memory held.
TEST(ImportTiff, BrokenFaxDataGivesNothingOfMemory) {
  const Scratch scratch;
  const PageKind kind{.width = 64, .height = 40, .bits = 1, .compression = COMPRESSION_CCITTFAX4, .rows_per_strip = 40};
  std::string packed(64 / 8 * 40, '\0');
  for (std::size_t i = 0; i < packed.size(); ++i) packed[i] = static_cast<char>(i * 37 % 251);
  const auto file = scratch.path("fax.tif");
  TIFF* tiff = TIFFOpen(file.c_str(), "w");
  setFields(tiff, kind);
  TIFFWriteEncodedStrip(tiff, 0, packed.data(), static_cast<tmsize_t>(packed.size()));
  TIFFClose(tiff);
  std::ifstream stream(file, std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(stream), {}};
  ASSERT_EQ(importAll(file).size(), 64u * 40);
  // What the allocator hands out again holds other bytes each time.
  const auto outcome = [&](const std::filesystem::path& path, int fill) {
    for (int i = 0; i < 64; ++i) {
      const std::vector<unsigned char> used(static_cast<std::size_t>(64 + 16 * i), static_cast<unsigned char>(fill));
      volatile unsigned char kept = used[0];
      (void)kept;
    }
    try {
      return importAll(path);
    } catch (const DataError& error) {
      return std::string(error.what());
    }
  };
  int errors = 0;
  for (std::size_t at = 8; at < 300 && at < whole.size(); ++at) {
    std::string broken = whole;
    broken[at] = static_cast<char>(~broken[at]);
    const auto path = scratch.write("broken.tif", broken);
    const std::string first = outcome(path, 0x55);
    ASSERT_EQ(first, outcome(path, 0xaa)) << at;
    errors += first.size() == 64u * 40 ? 0 : 1;
  }
  EXPECT_GT(errors, 20);
}

TEST(ImportTiff, StaysWithinMemory) {
  const Scratch scratch;
  const auto file =
      writeTiff(scratch, {.width = 300, .height = 300, .compression = COMPRESSION_LZW, .rows_per_strip = 300});
  ImportOptions options;
  options.memory_bytes = 100000;
  EXPECT_THAT(refusal({file}, options), HasSubstr("--memory"));
  options.memory_bytes = 1 << 20;
  EXPECT_EQ(importAll(file, options).size(), 90000u);
}

TEST(ImportTiff, RefusesEveryCutOfAFile) {
  const Scratch scratch;
  const auto file = writeTiff(scratch, {.compression = COMPRESSION_LZW}, 2);
  std::ifstream stream(file, std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(stream), {}};
  for (std::size_t length = 0; length < whole.size(); length += 3) {
    EXPECT_FALSE(refusal({scratch.write("cut.tif", whole.substr(0, length))}).empty()) << length;
  }
}

TEST(ImportTiff, EndsOnALoopOfDirectories) {
  const Scratch scratch;
  const auto file = writeTiff(scratch, {}, 1, "wl");
  std::fstream stream(file, std::ios::binary | std::ios::in | std::ios::out);
  std::uint32_t first = 0;
  stream.seekg(4);
  stream.read(reinterpret_cast<char*>(&first), 4);
  std::uint16_t count = 0;
  stream.seekg(first);
  stream.read(reinterpret_cast<char*>(&count), 2);
  stream.seekp(first + 2 + 12 * count);
  stream.write(reinterpret_cast<const char*>(&first), 4);  // the next directory is this one
  stream.close();
  EXPECT_THAT(refusal({file}), HasSubstr("page 1"));
}

}  // namespace
}  // namespace blockwalk
