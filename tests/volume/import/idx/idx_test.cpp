// SPDX-License-Identifier: Apache-2.0
#include <random>

#include "tests/volume/import/broken.h"
#include "tests/volume/import/idx/idx_writer.h"
#include "volume/formats/hz_order.h"
#include "volume/import/idx/idx_bits.h"
#include "volume/import/idx/idx_header.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;

std::string randomBytes(std::mt19937& random, std::size_t count) {
  std::string bytes(count, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random());
  return bytes;
}

TEST(IdxBits, IsMortonOrderWhereAxesTakeTurns) {
  const IdxBits bits{{0, 1, 2, 0, 1, 2, 0, 1, 2}};
  for (std::uint64_t code = 0; code < 512; ++code) {
    EXPECT_EQ(bits.position(code), mortonPosition(code));
    EXPECT_EQ(bits.code(mortonPosition(code)), code);
    EXPECT_EQ(bits.codeAt(hzFromCode(code, 9)), code);
  }
  EXPECT_EQ(bits.extent(3, 8), glm::ivec3(4, 4, 2));
}

// Four voxels in a row, two of them a block: addresses 0, 1 and 2, 3 are voxels 0, 2 and 1, 3.
TEST(ImportIdx, ReadsFourVoxelsByHand) {
  const Scratch scratch;
  const auto file = scratch.write(
      "v.idx",
      "(version)\n6\n(box)\n0 3 0 0\n(fields)\nf uint8\n(bits)\nV00\n(bitsperblock)\n1\n(blocksperfile)\n2\n"
      "(filename_template)\n./all.bin\n");
  scratch.write("all.bin", std::string(40, '\0') + std::string(8, '\0') + bigEndian(120) + bigEndian(0) + bigEndian(2) +
                               bigEndian(0) + std::string(16, '\0') + std::string(8, '\0') + bigEndian(122) +
                               bigEndian(0) + bigEndian(2) + bigEndian(0x10) + std::string(16, '\0') + "acbd");
  EXPECT_EQ(importAll(file), "abcd");
}

TEST(ImportIdx, ReadsEveryPackingOrderAndType) {
  std::mt19937 random(23);
  const std::pair<const char*, std::size_t> types[] = {{"uint8", 1},   {"int16", 2},    {"uint16", 2},
                                                       {"float32", 4}, {"uint8[3]", 3}, {"uint16[2]", 4}};
  const std::string orders[] = {"V012012012", "V00012121", "V2210", "V0101010"};
  for (const auto& [type, width] : types) {
    for (const std::string& order : orders) {
      const Scratch scratch;
      IdxWriter writer{.bits = order, .width = width, .fields = {fmt::format("a {} default_layout(1)", type)}};
      glm::ivec3 all{1};
      for (const char digit : order.substr(1)) all[digit - '0'] *= 2;
      writer.first = all / 4;
      writer.dims = glm::max(glm::ivec3(1), all - writer.first - all / 8);
      writer.block_bits = order.size() < 6 ? 2 : 4;
      writer.voxels = {randomBytes(random, cellCount(writer.dims) * width)};
      if (type == std::string("float32")) {
        for (std::size_t i = 3; i < writer.voxels[0].size(); i += 4) writer.voxels[0][i] = '\x41';
      }
      const auto file = writeIdx(scratch, writer, "v/", {0, 3, 7, 16, 19, 23});
      ImportOptions options;
      options.channels = width == 3 ? ChannelRule::automatic : ChannelRule::fields;
      const auto source = openSource({file}, options);
      EXPECT_EQ(source->info().dims, writer.dims) << type << order;
      EXPECT_EQ(source->info().format, "idx");
      const std::string read = readAll(*source);
      if (type == std::string("uint8") || type == std::string("uint16") || type == std::string("float32")) {
        EXPECT_TRUE(read == writer.voxels[0]) << type << order;
      } else if (width == 3) {
        ASSERT_EQ(source->info().type, VoxelType::rgba8);
        for (std::size_t i = 0; i < read.size(); i += 4) {
          ASSERT_EQ(read.substr(i, 3), writer.voxels[0].substr(i / 4 * 3, 3)) << order;
        }
      } else if (type == std::string("int16")) {
        EXPECT_EQ(source->info().channels[0].value_offset, -32768);
        for (std::size_t i = 0; i < read.size(); i += 2) {
          ASSERT_EQ(read[i], writer.voxels[0][i]);
          ASSERT_EQ(read[i + 1], static_cast<char>(writer.voxels[0][i + 1] ^ 0x80));
        }
      } else {
        ASSERT_EQ(source->info().channels.size(), 2u);
        for (std::size_t i = 0; i < read.size() / 2; i += 2) {
          ASSERT_EQ(read.substr(i, 2), writer.voxels[0].substr(2 * i, 2)) << order;
        }
      }
    }
  }
}

TEST(ImportIdx, ReadsFieldsAsChannelsAndDefaultsWhereNothingIs) {
  const Scratch scratch;
  std::mt19937 random(5);
  IdxWriter writer{.bits = "V012012012",
                   .dims = {7, 8, 5},
                   .width = 2,
                   .fields = {"one uint16 default_value(7)", "two uint16 default_compression(zip) default_value(300)"},
                   .missing = {1, 9, 31}};
  for (int i = 0; i < 2; ++i) writer.voxels.push_back(randomBytes(random, cellCount(writer.dims) * 2));
  const auto file = writeIdx(scratch, writer, "v/", {3});
  std::filesystem::remove(scratch.path("v/03.bin"));
  const auto source = openSource({file}, {});
  ASSERT_EQ(source->info().channels.size(), 2u);
  EXPECT_EQ(source->info().channels[1].name, "two");
  std::string expected = writer.voxels[0] + writer.voxels[1];
  for (const std::uint64_t block : {1, 3, 4, 5, 9, 31}) {
    for (std::uint64_t i = 0; i < 16; ++i) {
      const glm::ivec3 p = writer.position(block * 16 + i);
      if (glm::any(glm::greaterThanEqual(p, writer.dims))) continue;
      const std::size_t at = static_cast<std::size_t>(p.x + 7 * (p.y + 8 * p.z)) * 2;
      expected.replace(at, 2, std::string("\7\0", 2));
      expected.replace(writer.voxels[0].size() + at, 2, std::string("\x2c\1", 2));
    }
  }
  EXPECT_TRUE(readAll(*source) == expected);
  // In any order, by several, and with little memory.
  ImportOptions little;
  little.memory_bytes = 1024;
  const auto small = openSource({file}, little);
  const auto another = small->another();
  for (int i = 0; i < 100; ++i) {
    const auto z = static_cast<int>(random() % 5);
    const auto y = static_cast<int>(random() % 8);
    std::string row(28, '\0');
    (i % 2 == 0 ? *small : *another).readRows(z, y, 1, std::as_writable_bytes(std::span(row)));
    const std::size_t at = static_cast<std::size_t>(7 * (y + 8 * z)) * 2;
    ASSERT_EQ(row, expected.substr(at, 14) + expected.substr(writer.voxels[0].size() + at, 14));
  }
}

TEST(ImportIdx, LiesWhereItSays) {
  const Scratch scratch;
  const IdxWriter writer{.bits = "V012", .first = {1, 0, 1}, .dims = {1, 2, 1}};
  const auto place = [&](const std::string& more, std::optional<glm::dvec3> spacing = std::nullopt) {
    ImportOptions options;
    options.spacing = spacing;
    return openSource({scratch.write("v.idx", writer.header() + more)}, options)->info().world_from_index;
  };
  EXPECT_EQ(place("")[3], glm::dvec4(1, 0, 1, 1));
  const glm::dmat4 mapped = place("(logic_to_physic)\n2 0 0 5  0 0.1 0 6  0 0.5 3 7  0 0 0 1\n");
  EXPECT_EQ(mapped[1], glm::dvec4(0, 0.1, 0.5, 0));
  EXPECT_EQ(mapped[3], glm::dvec4(7, 6, 10, 1));
  const glm::dmat4 boxed = place("(physic_box)\n0.1 0.3 -1 1 5 6\n");
  EXPECT_EQ(boxed[0][0], 0.3 - 0.1);
  EXPECT_EQ(boxed[1][1], 1);
  EXPECT_EQ(boxed[3], glm::dvec4(0.1, -1, 5, 1));
  EXPECT_EQ(glm::length(glm::dvec3(place("", glm::dvec3(4))[2])), 4);
}

TEST(ImportIdx, NamesFilesFromTheRight) {
  const Scratch scratch;
  IdxWriter writer{.bits = "V" + std::string(14, '0') + std::string(14, '1'), .dims = {1, 1, 1}, .blocks_per_file = 1};
  ImportOptions options;
  const auto name = [&](const std::string& pattern, std::uint64_t block, const std::string& more = "") {
    writer.file_template = pattern;
    const InputFile file(scratch.write("v.idx", writer.header() + more));
    return readIdxHeader(file, options).fileOf(block, "v.idx");
  };
  EXPECT_EQ(name("./v/%02x/%04x.bin", 0x12), "./v/00/0012.bin");
  EXPECT_EQ(name("./v/%02x/%04x.bin", 0x56789a), "./v/56/789a.bin");
  EXPECT_EQ(name("./v/%02x.bin", 0x56789a), "./v/56/78/9a.bin") << "what is left over are folders";
  EXPECT_EQ(name("./v/%02x.bin", 0x9a, "(time)\n3 8 t%03d/\n"), "./v/t003/9a.bin");
  EXPECT_EQ(name("./v/%02x.bin", 0x9a, "(time)\nt%d/ (4,8,2)\n"), "./v/t4/9a.bin");
  EXPECT_EQ(name("./v/%02x.bin", 0x9a, "(time)\n0 0 %00000d/\n"), "./v/0/9a.bin");
  options.time = 2;
  options.step_count = std::make_shared<std::int64_t>(0);
  EXPECT_EQ(name("./v/%02x.bin", 0x9a, "(time)\n3 8 t%03d/\n"), "./v/t005/9a.bin");
  EXPECT_EQ(*options.step_count, 6);
  EXPECT_EQ(name("./v/%02x.bin", 0x9a, "(time)\nt%d/ (4,8,2)\n"), "./v/t8/9a.bin");
  EXPECT_EQ(*options.step_count, 3);
  options = {};
  writer.blocks_per_file = 256;
  EXPECT_EQ(name("./v/%04x.bin", 0x1234), "./v/1200.bin");
  writer.blocks_per_file = -1;
  EXPECT_EQ(name("./all.bin", 0x1234), "./all.bin");
}

struct BadIdx {
  const char* from;
  const char* to;
  const char* message;
};

const BadIdx kBadIdx[] = {
    {"6  #", "5 #", "version: 5 cannot be read, 6 can"},
    {"(box)", "(bax)", "box: the field is missing"},
    {"0 6 0 7 0 4", "0 8 0 7 0 4", "box: 0..8 along axis 0 is empty or outside 0..7"},
    {"0 6 0 7 0 4", "3 2 0 7 0 4", "box: 3..2"},
    {"0 6 0 7 0 4", "-1 2 0 7 0 4", "box: -1..2"},
    {"0 6 0 7 0 4", "0 6 0 7 0", "box: 9 numbers"},
    {"0 0 0 0\n", "0 1 0 0\n", "box: 0..1 along axis 3"},
    {"V012012012", "012012012", "is no V with digits"},
    {"V012012012", "V013", "names other axes"},
    {"V012012012", "V00000000000000000", "more than 16 of axis 0"},
    {"uint8", "uint9", "type 'uint9' cannot be read"},
    {"uint8", "uint8[5]", "5 values a voxel, must be 1..4"},
    {"uint8", "", "has no name and type"},
    {"uint8\n", "uint8 + b uint16\n", "not single values of one type"},
    {"uint8\n", "uint8 + b uint8 + c uint8 + d uint8 + e uint8\n", "more than 4"},
    {"uint8\n", "uint8 default_value(x)\n", "'x' is no finite number"},
    {"(bitsperblock)\n4", "(bitsperblock)\n21", "bitsperblock: 21 is outside 0..20"},
    {"(blocksperfile)\n3", "(blocksperfile)\n-2", "blocksperfile: -2"},
    {"(blocksperfile)\n3", "(blocksperfile)\n99999999999", "blocksperfile: 99999999999"},
    {"%02x", "%2x", "has other places than"},
    {"%02x", "%s", "has other places than"},
    {"%02x", "00", "has no place for the number"},
    {"./v", "../v", "must be a name inside"},
    {"./v", "/v", "must be a name inside"},
    {"./v", "link", "leads out"},
    {"block)\n0", "block)\n1", "interleave block"},
    {"(filename", "(arco)\n8mb\n(filename", "arco: '8mb'"},
    {"(filename", "(time)\n* * t%d/\n(filename", "time: '*'"},
    {"(filename", "(time)\n0 1 t%s/\n(filename", "names no first step"},
    {"(filename", "(time)\n5 1 t%d/\n(filename", "must ascend"},
    {"(filename", "(time)\nt%d/ (0,9,0)\n(filename", "must ascend"},
    {"(filename", "(version)\n6\n(filename", "stands in the header twice"},
    {"(filename", "(physic_box)\n0 0 0 1 0 1\n(filename", "axis 0 has length 0"},
    {"(filename", "(logic_to_physic)\n1 0 0\n(filename", "3 numbers, must be 16"},
};

TEST(ImportIdx, RefusesByFieldAndBound) {
  const Scratch scratch;
  const Scratch elsewhere;
  IdxWriter writer{.bits = "V012012012", .dims = {7, 8, 5}};
  writer.voxels = {std::string(280, 'v')};
  EXPECT_EQ(importAll(writeIdx(scratch, writer, "v/", {0})), writer.voxels[0]);
  elsewhere.write("00.bin", "x");
  std::filesystem::create_directory_symlink(elsewhere.path(""), scratch.path("link"));
  for (const BadIdx& bad : kBadIdx) {
    std::string text = writer.header();
    const std::size_t at = text.find(bad.from);
    ASSERT_NE(at, std::string::npos) << bad.from;
    const std::string message = refusal({scratch.write("v.idx", text.replace(at, std::strlen(bad.from), bad.to))});
    EXPECT_THAT(message, HasSubstr(bad.message)) << bad.to;
    EXPECT_THAT(message, HasSubstr("v.idx")) << bad.to;
  }
  ImportOptions options;
  options.memory_bytes = 63;
  EXPECT_THAT(refusal({scratch.write("v.idx", writer.header())}, options), HasSubstr("makes blocks of 16 bytes"));
}

// A header without files of blocks, and files that cannot be looked at.
TEST(ImportIdx, RefusesWhatIsNearlyAllDefault) {
  const Scratch scratch;
  IdxWriter writer{.bits = "V012012012", .dims = {7, 8, 5}};
  writer.voxels = {std::string(280, 'v')};
  writeIdx(scratch, writer, "v/", {0});
  std::string bits = "V";
  for (int i = 0; i < 16; ++i) bits += "012";
  IdxWriter huge = writer;
  huge.bits = bits;
  huge.dims = {65536, 65536, 65536};
  EXPECT_THAT(refusal({scratch.write("huge.idx", huge.header())}), HasSubstr("filename_template: the files of blocks"));
}

// What is cut off a header is a field that is missing: each is there, and the last has one letter.
TEST(ImportIdx, SurvivesBreaking) {
  const Scratch scratch;
  const std::string header =
      "(version)\n6\n(filename_template)\n./all.bin\n(box)\n0 3 0 0\n(fields)\nf uint8\n(bits)\nV00\n"
      "(blocksperfile)\n2\n(bitsperblock)\n1\n";
  scratch.write("all.bin", std::string(40, '\0') + std::string(8, '\0') + bigEndian(120) + bigEndian(0) + bigEndian(2) +
                               bigEndian(0) + std::string(16, '\0') + std::string(8, '\0') + bigEndian(122) +
                               bigEndian(0) + bigEndian(2) + bigEndian(0x10) + std::string(16, '\0') + "acbd");
  EXPECT_EQ(importAll(scratch.write("v.idx", header)), "abcd");
  survivesBreaking(scratch, "v.idx", header);
}

TEST(ImportIdx, SurvivesBrokenFilesOfBlocks) {
  std::mt19937 random(31);
  for (const std::uint32_t packing : {0, 3, 7, 16}) {
    const Scratch scratch;
    IdxWriter writer{.bits = "V01201", .dims = {4, 4, 2}, .block_bits = 3, .blocks_per_file = 4};
    writer.voxels = {randomBytes(random, cellCount(writer.dims))};
    writeIdx(scratch, writer, "v/", {packing});
    survivesBreaking(scratch, "v/00.bin", filesOf(writer, 0, {packing}), "v.idx");
    EXPECT_EQ(importAll(scratch.path("v.idx")), writer.voxels[0]) << packing;
  }
}

TEST(ImportIdx, RefusesBrokenBlocks) {
  const Scratch scratch;
  IdxWriter writer{.bits = "V012012", .dims = {4, 4, 4}, .block_bits = 6, .blocks_per_file = 1};
  std::mt19937 random(1);
  writer.voxels = {randomBytes(random, 64)};
  const auto with = [&](std::uint32_t flags, std::size_t at, const std::string& bytes) {
    const auto file = writeIdx(scratch, writer, "v/", {flags});
    std::string block = filesOf(writer, 0, {flags});
    scratch.write("v/00.bin", block.replace(at, bytes.size(), bytes));
    return refusal({file});
  };
  EXPECT_THAT(with(0, 40 + 20, bigEndian(4)), HasSubstr("00.bin: block 0: flags 0x4"));
  EXPECT_THAT(with(0, 40 + 16, bigEndian(63)), HasSubstr("block 0: 63 bytes from byte 80 are declared for 64"));
  EXPECT_THAT(with(3, 40 + 16, bigEndian(0xffffffff)), HasSubstr("4294967295 bytes"));
  EXPECT_THAT(with(0, 40 + 12, bigEndian(0xffffffff)), HasSubstr("from byte 18446744069414584400"));
  EXPECT_THAT(with(0, 40 + 8, bigEndian(81)), HasSubstr("the file has 144"));
  EXPECT_THAT(with(3, 82, "no zip"), HasSubstr("do not unpack to 64"));
  EXPECT_THAT(with(7, 80, "\x10"), HasSubstr("do not unpack to 64"));
  const auto file = writeIdx(scratch, writer, "v/", {0});
  std::filesystem::resize_file(scratch.path("v/00.bin"), 60);
  EXPECT_THAT(refusal({file}), HasSubstr("the file ends at byte 60"));
}

}  // namespace
}  // namespace blockwalk
