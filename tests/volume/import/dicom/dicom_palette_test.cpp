// SPDX-License-Identifier: Apache-2.0
// Palettes, single bits and deflated data sets of DICOM.
#include "tests/volume/import/broken.h"
#include "tests/volume/import/dicom/dicom_writer.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;

constexpr const char* kDeflated = "1.2.840.10008.1.2.1.99";

// 3 x 2 pixels of 8 bits that stand for colours.
DicomWriter colored(const std::string& pixels, const char* syntax = "1.2.840.10008.1.2.1") {
  auto writer = slice("0\\0\\0", 0, syntax);
  writer.text(0x00280004, "CS", "PALETTE COLOR").whole(0x00280100, 8).whole(0x00280101, 8).whole(0x00280102, 7);
  return writer.bytes(0x7fe00010, "OW", pixels);
}

DicomWriter& describe(DicomWriter& writer, const std::vector<int>& descriptor) {
  for (std::uint32_t color = 0; color < 3; ++color) writer.wholes(0x00281101 + color, descriptor);
  return writer;
}

std::string rgba(const std::vector<std::array<int, 3>>& colors) {
  std::string all;
  for (const auto& [red, green, blue] : colors) {
    for (const int value : {red, green, blue, std::max({red, green, blue})}) all += static_cast<char>(value);
  }
  return all;
}

TEST(ImportDicomPalette, OfEightAndSixteenBits) {
  const Scratch scratch;
  const auto stored = [&](const DicomWriter& writer) { return importAll(scratch.write("a.dcm", writer.file())); };
  // Entries for 2, 3 and 4: what is below is the first, what is beyond the last.
  const std::string pixels("\x00\x02\x03\x04\x05\xff", 6);
  const auto expected = rgba({{10, 40, 70}, {10, 40, 70}, {20, 50, 80}, {30, 60, 90}, {30, 60, 90}, {30, 60, 90}});
  const std::vector<std::vector<int>> entries = {{10, 20, 30}, {40, 50, 60}, {70, 80, 90}};
  for (const char* syntax : {"1.2.840.10008.1.2", "1.2.840.10008.1.2.1", kDeflated}) {
    auto bytes = colored(pixels, syntax);
    describe(bytes, {3, 2, 8});
    for (std::uint32_t color = 0; color < 3; ++color) {
      std::string table;
      for (const int value : entries[color]) table += static_cast<char>(value);
      bytes.bytes(0x00281201 + color, "OW", table);
    }
    EXPECT_EQ(stored(bytes), expected) << syntax;
    EXPECT_EQ(openSource({scratch.path("a.dcm")}, {})->info().type, VoxelType::rgba8);
  }
  for (const char* syntax : {"1.2.840.10008.1.2.1", "1.2.840.10008.1.2.2"}) {
    // Of 8 bits in words, and of 16 bits, which are colours of 16 bits.
    for (const int factor : {1, 257}) {
      auto words = colored(pixels, syntax);
      describe(words, {3, 2, factor == 1 ? 8 : 16});
      for (std::uint32_t color = 0; color < 3; ++color) {
        std::vector<int> table;
        for (const int value : entries[color]) table.push_back(value * factor);
        words.wholes(0x00281201 + color, table, "OW");
      }
      EXPECT_EQ(stored(words), expected) << syntax << " " << factor;
    }
  }
  // Pixels of 16 bits, with a sign, and 65536 entries, which the descriptor spells 0.
  auto wide = slice("0\\0\\0", 0).text(0x00280004, "CS", "PALETTE COLOR").whole(0x00280103, 1);
  describe(wide, {0, -32768, 16});
  std::vector<int> ramp(65536);
  for (int i = 0; i < 65536; ++i) ramp[static_cast<std::size_t>(i)] = i;
  for (std::uint32_t color = 0; color < 3; ++color) wide.wholes(0x00281201 + color, ramp, "OW");
  wide.pixels(bytesOf<std::int16_t>({-32768, -32511, 0, 1, 32767, 128}));
  EXPECT_EQ(stored(wide).substr(0, 8), rgba({{0, 0, 0}, {1, 1, 1}}));
  EXPECT_EQ(stored(wide).substr(16, 4), rgba({{255, 255, 255}}));
}

TEST(ImportDicomPalette, OfSegments) {
  const Scratch scratch;
  const std::string pixels("\x00\x01\x02\x03\x04\x05", 6);
  // Two entries, a ramp of two up to 40, and the first segment again.
  for (const char* syntax : {"1.2.840.10008.1.2.1", "1.2.840.10008.1.2.2"}) {
    auto words = colored(pixels, syntax);
    describe(words, {6, 0, 16});
    const std::vector<int> parts{0, 2, 10 * 257, 20 * 257, 1, 2, 40 * 257, 2, 1, 0, 0};
    for (std::uint32_t color = 0; color < 3; ++color) words.wholes(0x00281221 + color, parts, "OW");
    EXPECT_EQ(importAll(scratch.write("a.dcm", words.file())),
              rgba({{10, 10, 10}, {20, 20, 20}, {30, 30, 30}, {40, 40, 40}, {10, 10, 10}, {20, 20, 20}}));
  }
  auto bytes = colored(pixels);
  describe(bytes, {6, 0, 8});
  const std::string narrow("\x00\x02\x0a\x14\x01\x02\x28\x02\x01\x00\x00\x00\x00", 13);
  for (std::uint32_t color = 0; color < 3; ++color) bytes.bytes(0x00281221 + color, "OW", narrow);
  EXPECT_EQ(importAll(scratch.write("a.dcm", bytes.file())),
            rgba({{10, 10, 10}, {20, 20, 20}, {30, 30, 30}, {40, 40, 40}, {10, 10, 10}, {20, 20, 20}}));
  const auto refused = [&](const std::vector<int>& parts) {
    auto words = colored(pixels);
    describe(words, {6, 0, 16});
    for (std::uint32_t color = 0; color < 3; ++color) words.wholes(0x00281221 + color, parts, "OW");
    return refusal({scratch.write("a.dcm", words.file())});
  };
  EXPECT_THAT(refused({0, 7, 1, 2, 3, 4, 5, 6, 7}), HasSubstr("has more than the 6 entries"));
  EXPECT_THAT(refused({0, 5, 1, 2, 3, 4, 5}), HasSubstr("has 5 entries, its descriptor says 6"));
  EXPECT_THAT(refused({0, 6, 1, 2}), HasSubstr("SegmentedRedPaletteColorLookupTableData: ends in a segment"));
  EXPECT_THAT(refused({1, 6, 1}), HasSubstr("goes on from the entry before"));
  EXPECT_THAT(refused({3, 6, 1}), HasSubstr("segment of kind 3"));
  EXPECT_THAT(refused({2, 1, 0, 0}), HasSubstr("segment of kind 2 at its part 0 cannot be"));
}

TEST(ImportDicomPalette, NamesWhatIsWrong) {
  const Scratch scratch;
  const auto with = [&](const std::function<void(DicomWriter&)>& change) {
    auto writer = colored("\x01\x02\x03\x04\x05\x06");
    describe(writer, {4, 0, 8});
    for (std::uint32_t color = 0; color < 3; ++color) writer.bytes(0x00281201 + color, "OW", "abcd");
    change(writer);
    return refusal({scratch.write("a.dcm", writer.file())});
  };
  EXPECT_THAT(with([](DicomWriter& w) { w.bytes(0x00281202, "OW", "ab"); }),
              HasSubstr("GreenPaletteColorLookupTableData: has 2 bytes, 4 entries of 8 bits need 4"));
  EXPECT_THAT(with([](DicomWriter& w) { w.without(0x00281203); }),
              HasSubstr("BluePaletteColorLookupTableData: the element is missing"));
  EXPECT_THAT(with([](DicomWriter& w) {
                w.wholes(0x00281102, {5, 0, 8});
              }),
              HasSubstr("GreenPaletteColorLookupTableDescriptor: differs from the red one"));
  EXPECT_THAT(with([](DicomWriter& w) { describe(w, {4, 0, 12}); }), HasSubstr("12 bits an entry"));
  ImportOptions little;
  little.memory_bytes = 20;
  EXPECT_THAT(refusal({[&] {
                        auto writer = colored("\x01\x02\x03\x04\x05\x06");
                        describe(writer, {4, 0, 8});
                        for (std::uint32_t c = 0; c < 3; ++c) writer.bytes(0x00281201 + c, "OW", "abcd");
                        return scratch.write("a.dcm", writer.file());
                      }()},
                      little),
              HasSubstr("a frame of 6 bytes takes 24 of memory, 20 are allowed"));
}

TEST(ImportDicomBits, AreZerosAndOnes) {
  const Scratch scratch;
  // 3 x 2 pixels a frame, so that frames begin within bytes: 101010 010101 110000.
  auto writer = slice("0\\0\\0", 0).whole(0x00280100, 1).whole(0x00280101, 1).whole(0x00280102, 0);
  writer.without(0x00281052).without(0x00281053).text(0x00280008, "IS", "3");
  writer.bytes(0x7fe00010, "OB", std::string("\x95\x3a\x00", 3));
  const auto path = scratch.write("a.dcm", writer.file());
  EXPECT_EQ(importAll(path), std::string("\1\0\1\0\1\0\0\1\0\1\0\1\1\1\0\0\0\0", 18));
  writer.text(0x00280004, "CS", "MONOCHROME1");
  EXPECT_EQ(importAll(scratch.write("a.dcm", writer.file())), std::string("\0\1\0\1\0\1\1\0\1\0\1\0\0\0\1\1\1\1", 18));
  writer.text(0x00280008, "IS", "6");
  EXPECT_THAT(refusal({scratch.write("a.dcm", writer.file())}),
              HasSubstr("PixelData: 4 bytes are there, 6 frames of 3 x 2 need 5"));
}

TEST(ImportDicomDeflated, IsReadAsIfItWerePlain) {
  const Scratch scratch;
  std::vector<std::uint16_t> words(20 * 300 * 6);
  for (std::size_t i = 0; i < words.size(); ++i) words[i] = static_cast<std::uint16_t>(i * 7919);
  const auto make = [&](const char* syntax) {
    auto writer = slice("0\\0\\0", 0, syntax).whole(0x00280010, 20).whole(0x00280011, 300).text(0x00280008, "IS", "6");
    return writer.pixels(bytesOf(words)).file();
  };
  const std::string plain = importAll(scratch.write("p.dcm", make("1.2.840.10008.1.2.1")));
  const std::string deflated = make(kDeflated);
  EXPECT_EQ(importAll(scratch.write("d.dcm", deflated)), plain);
  // A series, and one that goes back and forth.
  scratch.write("s/1", slice("0\\0\\2", 100, kDeflated).file());
  scratch.write("s/2", slice("0\\0\\1", 200, kDeflated).file());
  EXPECT_EQ(importAll(scratch.path("s")),
            bytesOf<std::uint16_t>({200, 201, 202, 203, 204, 205, 100, 101, 102, 103, 104, 105}));
  EXPECT_THAT(refusal({scratch.write("c.dcm", deflated.substr(0, deflated.size() / 2))}), HasSubstr("cut off"));
  std::string broken = deflated;
  for (std::size_t i = 300; i < 340; ++i) broken[i] = '\xff';
  EXPECT_THAT(refusal({scratch.write("b.dcm", broken)}), HasSubstr("the compressed data is broken near byte"));
}

TEST(ImportDicomPalette, SurvivesCutsAndFlippedBits) {
  const Scratch scratch;
  auto table = colored("\x01\x02\x03\x04\x05\x06");
  describe(table, {4, 0, 8});
  for (std::uint32_t color = 0; color < 3; ++color) table.bytes(0x00281201 + color, "OW", "abcd");
  auto segments = colored("\x01\x02\x03\x04\x05\x06", kDeflated);
  describe(segments, {6, 0, 16});
  for (std::uint32_t c = 0; c < 3; ++c) segments.wholes(0x00281221 + c, {0, 2, 1, 2, 1, 2, 4, 2, 1, 0, 0}, "OW");
  for (const std::string& whole : {table.file(), segments.file()}) survivesBreakingInBounds(scratch, "x.dcm", whole);
}

}  // namespace
}  // namespace blockwalk
