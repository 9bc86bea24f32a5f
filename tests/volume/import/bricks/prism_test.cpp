// SPDX-License-Identifier: Apache-2.0
#include <random>

#include "tests/volume/import/broken.h"
#include "volume/formats/hz_order.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;

// The Morton code of the voxel at an address, the other way round than the program goes: a one behind it, moved up
// until it is as long as a marked code, and the mark taken off.
std::uint64_t mortonOfHz(std::uint64_t address, int bits) {
  std::uint64_t code = address << 1 | 1;
  while (code >> (3 * bits) == 0) code <<= 1;
  return code ^ std::uint64_t{1} << (3 * bits);
}

struct TestBrick {
  const char* file;
  int side;
  glm::ivec3 position;
};

// Samples of 16 bits in rows, as big as the bricks that are put into it.
struct Box {
  glm::ivec3 dims{0};
  std::vector<std::uint16_t> samples = std::vector<std::uint16_t>(static_cast<std::size_t>(dims.x * dims.y * dims.z));

  std::uint16_t& at(glm::ivec3 p) { return samples[static_cast<std::size_t>(p.x + dims.x * (p.y + dims.y * p.z))]; }
  // What a source of the whole box yields.
  std::string bytes(int width) const {
    if (width == 2) return bytesOf(samples);
    return bytesOf(std::vector<std::uint8_t>(samples.begin(), samples.end()));
  }
};

std::string brickBytes(const TestBrick& brick, int width, bool big_endian, Box& box, std::mt19937& random) {
  const bool is_hz = std::string_view(brick.file).ends_with(".hz");
  std::string bytes;
  for (int i = 0; i < brick.side * brick.side * brick.side; ++i) {
    const glm::ivec3 raster(i % brick.side, i / brick.side % brick.side, i / brick.side / brick.side);
    const int bits = std::countr_zero(static_cast<unsigned>(brick.side));
    const auto sample = static_cast<std::uint16_t>(random() & (width == 2 ? 0xffff : 0xff));
    box.at(brick.position + (is_hz ? mortonPosition(mortonOfHz(static_cast<std::uint64_t>(i), bits)) : raster)) =
        sample;
    const std::string little = bytesOf<std::uint16_t>({sample}).substr(0, static_cast<std::size_t>(width));
    bytes += big_endian ? swapped(little, little.size()) : little;
  }
  return bytes;
}

std::string metadataText(const std::vector<TestBrick>& bricks, const std::string& rest) {
  std::string text = "{\n  \"minLevel\": 4, \"bricks\": [";
  for (const TestBrick& brick : bricks) {
    text += fmt::format("\n{{\"filename\": \"{}\", \"size\": {}, \"position\": [{}, {}, {}]}},", brick.file, brick.side,
                        brick.position.x, brick.position.y, brick.position.z);
  }
  return text + "],\n" + rest + ",\n}\n";
}

const std::string kRest = R"("bytesPerPixel":1,"scale":[1,1.5,2],"globalSize":[32,32,32])";
// Of every size between one voxel and more than a cube, in both orders; none at 8,0,0 nor at 16,16,8.
const std::vector<TestBrick> kBricks = {{"0.hz", 8, {0, 0, 0}},    {"1.raw", 8, {0, 8, 0}},  {"2.hz", 8, {8, 8, 0}},
                                        {"3.raw", 16, {16, 0, 0}}, {"4.hz", 16, {0, 16, 0}}, {"5.hz", 4, {8, 0, 8}},
                                        {"6.hz", 1, {12, 1, 8}},   {"7.hz", 2, {14, 2, 8}},  {"8.raw", 4, {28, 16, 0}}};
const glm::ivec3 kDims(32, 32, 16);

TEST(HzOrder, IsThatOfEightVoxelsByHand) {
  const std::uint64_t expected[] = {0, 4, 2, 5, 1, 6, 3, 7};  // by Morton code
  for (std::uint64_t code = 0; code < 8; ++code) EXPECT_EQ(hzFromMorton(code, 1), expected[code]) << code;
  EXPECT_EQ(hzFromMorton(0, 0), 0u);
  EXPECT_EQ(hzAddress({2, 0, 0}, 2), 4u) << "what the coarser cube has of it comes first";
  EXPECT_EQ(hzAddress({1, 0, 0}, 2), 32u);
}

TEST(HzOrder, GoesBackToTheMortonCode) {
  for (int bits = 0; bits < 5; ++bits) {
    for (std::uint64_t address = 0; address >> (3 * bits) == 0; ++address) {
      ASSERT_EQ(hzFromMorton(mortonOfHz(address, bits), bits), address) << bits;
    }
  }
}

TEST(ImportPrism, ReadsBricksOfAllSizesInBothOrders) {
  for (const int width : {1, 2}) {
    for (const bool big_endian : {true, false}) {
      const Scratch scratch;
      std::mt19937 random(7);
      Box box{.dims = kDims};
      for (const TestBrick& brick : kBricks) {
        scratch.write(brick.file, brickBytes(brick, width, big_endian, box, random));
      }
      const std::string order = big_endian ? "BIG_ENDIAN" : "LITTLE_ENDIAN";
      scratch.write("metadata.json",
                    metadataText(kBricks, fmt::format(R"("bytesPerPixel":{},"scale":[1,1.5,2],"endianness":"{}",)"
                                                      R"("globalSize":[32,32,32],"totalBricks":9)",
                                                      width, order)));
      const auto source = openSource({scratch.path("")}, {});
      EXPECT_EQ(source->info().dims, kDims) << "where the bricks end";
      EXPECT_EQ(source->info().type, width == 1 ? VoxelType::u8 : VoxelType::u16);
      EXPECT_EQ(source->info().format, "prism");
      EXPECT_THAT(source->info().notes, testing::ElementsAre(HasSubstr("true size")));
      EXPECT_EQ(source->info().world_from_index, glm::dmat4(glm::dvec4(1, 0, 0, 0), glm::dvec4(0, 1.5, 0, 0),
                                                            glm::dvec4(0, 0, 2, 0), glm::dvec4(0, 0, 0, 1)));
      for (const int rows : {1, 3, 8, 32}) EXPECT_EQ(readAll(*source, rows), box.bytes(width)) << rows;
      EXPECT_EQ(importAll(scratch.path("metadata.json")), box.bytes(width)) << "the file stands for its folder";
    }
  }
}

// With room for no more than a cube each is read again and again, and none is wrong.
TEST(ImportPrism, ReadsInAnyOrderAndWithLittleMemory) {
  const Scratch scratch;
  std::mt19937 random(11);
  Box box{.dims = {128, 128, 128}};
  const TestBrick brick{"0.hz", 128, {0, 0, 0}};
  scratch.write("0.hz", brickBytes(brick, 2, true, box, random));
  scratch.write("metadata.json", metadataText({brick}, R"("bytesPerPixel":2,"scale":[1,1,1],"endianness":"BIG_ENDIAN",)"
                                                       R"("globalSize":[128,128,128])"));
  const std::string expected = box.bytes(2);
  const std::size_t plane = std::size_t{128} * 128 * 2;
  for (const std::uint64_t memory : {std::uint64_t{1} << 30, 128 * plane, 20 * plane, std::uint64_t{2048}}) {
    ImportOptions options;
    options.memory_bytes = memory;
    const auto source = openSource({scratch.path("")}, options);
    const auto another = source->another();
    std::string rows(11 * 256, '\0');
    for (int i = 0; i < 200; ++i) {
      const auto z = static_cast<int>(random() % 128);
      const auto y = static_cast<int>(random() % 118);
      (i % 2 == 0 ? *source : *another).readRows(z, y, 11, std::as_writable_bytes(std::span(rows)));
      const std::size_t at = static_cast<std::size_t>(z) * plane + static_cast<std::size_t>(y) * 256;
      ASSERT_EQ(rows, expected.substr(at, rows.size())) << z << " " << y << " " << memory;
    }
    EXPECT_EQ(readAll(*source, 8), expected);
  }
}

TEST(ImportPrism, ATrueSizeCutsThePaddingOff) {
  const Scratch scratch;
  std::mt19937 random(3);
  Box box{.dims = {8, 8, 8}};
  scratch.write("0.hz", brickBytes({"0.hz", 8, {0, 0, 0}}, 1, true, box, random));
  scratch.write("metadata.json", metadataText({{"0.hz", 8, {0, 0, 0}}}, kRest + R"(,"trueSize":[5,8,3])"));
  const auto source = openSource({scratch.path("")}, {});
  EXPECT_EQ(source->info().dims, glm::ivec3(5, 8, 3));
  EXPECT_THAT(source->info().notes, testing::IsEmpty());
  Box cut{.dims = {5, 8, 3}};
  for (int i = 0; i < 120; ++i) {
    const glm::ivec3 p(i % 5, i / 5 % 8, i / 40);
    cut.at(p) = box.at(p);
  }
  EXPECT_EQ(readAll(*source), cut.bytes(1));
}

// An octree says -1 where a larger brick of another cell has the voxels.
TEST(ImportPrism, PassesOverTheOctree) {
  const Scratch scratch;
  scratch.write("0.raw", std::string(512, 'x'));
  scratch.write(
      "metadata.json",
      R"({"octree":{"Children":[{"Value":-1},{"Value":0}]},"totalOctnodes":3,"bricks":[{"note":[1,{"a":null}],)"
      R"("filename":"0.raw","size":8,"position":[0,0,0]}],)" +
          kRest + "}");
  EXPECT_EQ(importAll(scratch.path("")), std::string(512, 'x'));
}

TEST(ImportPrism, AFolderOfSlicesMayHaveJsonOfItsOwn) {
  const Scratch scratch;
  scratch.write("metadata.json", R"({"camera": "bricks of nothing"})");
  EXPECT_THAT(refusal({scratch.path("")}), HasSubstr("PNG"));
}

struct BadMetadata {
  const char* from;  // what of the text is replaced, the first time
  const char* to;
  const char* message;
};

const BadMetadata kBad[] = {
    {"\"size\": 8", "\"size\": 12", "size 12 of number 0 is no power of two of 1..512"},
    {"\"size\": 8", "\"size\": 1024", "size 1024"},
    {"\"size\": 8", "\"size\": 0", "size 0"},
    {"\"size\": 8", "\"size\": 8.5", "size at byte"},
    {"\"size\": 8,", "", "number 0 lacks"},
    {"\"size\": 8", "\"size\": 4", "has 512 bytes, a brick of size 4 takes 64"},
    {"\"size\": 8", "\"size\": 8, \"size\": 8", "twice"},
    {"[0, 0, 0]", "[4, 0, 0]", "position 4 of '0.hz' is no multiple of its size 8"},
    {"[0, 0, 0]", "[-8, 0, 0]", "position -8"},
    {"[0, 0, 0]", "[65536, 0, 0]", "position 65536"},
    {"[0, 0, 0]", "[0, 32, 0]", "ends at 8,40,8, outside globalSize"},
    {"[0, 0, 0]", "[8, 0, 0]", "'0.hz' and '1.raw' overlap"},
    {"[0, 0, 0]", "[0, 0]", "position at byte"},
    {"[0, 0, 0]", "[0, 0, 0, 0]", "more than 3 numbers"},
    {"0.hz", "../0.hz", "must be a name without a folder"},
    {"0.hz", "..", "must be a name without a folder"},
    {"0.hz", "/etc/passwd", "must be a name without a folder"},
    {"0.hz", "x.hz", "cannot be opened"},
    {"0.hz", "0.txt", "neither .hz nor .raw"},
    {"0.hz", "link.hz", "leads out"},
    {"0.hz", "0\\u002ehz", "escapes"},
    {"[32,32,32]", "[32,32,65537]", "globalSize: 65537 is outside 1..65536"},
    {"[32,32,32]", "[32,32,0]", "globalSize: 0 is outside"},
    {"[1,1.5,2]", "[1,0,2]", "scale: the step along axis 1"},
    {"[1,1.5,2]", "[1,1e999,2]", "is no finite number"},
    {"\"bytesPerPixel\":1", "\"bytesPerPixel\":3", "bytesPerPixel: 3 is neither 1 nor 2"},
    {"\"bytesPerPixel\":1", "\"bytesPerPixel\":2", "endianness: the field is missing"},
    {"\"bytesPerPixel\":1", "\"endianness\":\"MIDDLE\",\"bytesPerPixel\":1", "endianness: 'MIDDLE'"},
    {"\"bytesPerPixel\":1", "\"totalBricks\":3,\"bytesPerPixel\":1", "totalBricks: 3 are said, bricks has 2"},
    {"\"bytesPerPixel\":1", "\"trueSize\":[33,8,8],\"bytesPerPixel\":1", "trueSize: 33,8,8 is larger"},
    {"\"bytesPerPixel\":1,", "", "bytesPerPixel: the field is missing"},
    {"\"scale\":[1,1.5,2],", "", "scale: the field is missing"},
    {"\"bytesPerPixel\"", "bytesPerPixel", "must stand here"},
    {",\n}", "", "must stand here"},
    {",\n}", "} true", "something follows"},
    {"\"minLevel\": 4", "\"minLevel\": maybe", "'maybe' is no value"},
};

TEST(ImportPrism, RefusesByFieldAndBound) {
  const Scratch scratch;
  const Scratch elsewhere;
  scratch.write("0.hz", std::string(512, 'a'));
  scratch.write("1.raw", std::string(512, 'b'));
  std::filesystem::create_symlink(elsewhere.write("0.hz", std::string(512, 'c')), scratch.path("link.hz"));
  const std::string good = metadataText({{"0.hz", 8, {0, 0, 0}}, {"1.raw", 8, {8, 0, 0}}}, kRest);
  scratch.write("metadata.json", good);
  EXPECT_EQ(importAll(scratch.path("")).size(), 1024u);
  for (const BadMetadata& bad : kBad) {
    std::string text = good;
    const std::size_t at = text.find(bad.from);
    ASSERT_NE(at, std::string::npos) << bad.from;
    scratch.write("metadata.json", text.replace(at, std::strlen(bad.from), bad.to));
    const std::string message = refusal({scratch.path("")});
    EXPECT_THAT(message, HasSubstr(bad.message)) << bad.to;
    EXPECT_THAT(message, HasSubstr("metadata.json")) << bad.to;
  }
}

TEST(ImportPrism, RefusesWhatWouldTakeTooMuch) {
  const Scratch scratch;
  scratch.write("0.raw", "a");
  scratch.write("1.raw", "b");
  const std::string far = R"("bytesPerPixel":1,"scale":[1,1,1],"globalSize":[65536,65536,65536])";
  scratch.write("metadata.json", metadataText({{"0.raw", 1, {0, 0, 0}}, {"1.raw", 1, {65535, 9, 9}}}, far));
  EXPECT_THAT(refusal({scratch.path("")}), HasSubstr("they hold 2 voxels of the 6553600 up to their ends"));
  const std::string said = far + R"(,"trueSize":[65536,65536,65536])";
  scratch.write("metadata.json", metadataText({{"0.raw", 1, {0, 0, 0}}}, said));
  EXPECT_THAT(refusal({scratch.path("")}), HasSubstr("they hold 1 voxels of the 281474976710656 of trueSize"));
  scratch.write("metadata.json", "{\"bricks\":" + std::string(1000, '[') + std::string(1000, ']') + "}");
  EXPECT_THAT(refusal({scratch.path("")}), HasSubstr("bricks at byte"));
  scratch.write("metadata.json", "{\"bricks\":[],\"x\":" + std::string(1000, '['));
  EXPECT_THAT(refusal({scratch.path("")}), HasSubstr("nested more than 64 times"));
  scratch.write("metadata.json", metadataText({}, kRest));
  EXPECT_THAT(refusal({scratch.path("")}), HasSubstr("bricks: there are none"));
  std::filesystem::resize_file(scratch.path("metadata.json"), std::uintmax_t{1} << 40);
  EXPECT_THAT(refusal({scratch.path("")}), HasSubstr("at most 16777216 are read"));
}

TEST(ImportPrism, SurvivesBreaking) {
  const Scratch scratch;
  std::mt19937 random(7);
  const std::vector<TestBrick> bricks = {{"0.hz", 4, {0, 0, 0}}, {"1.raw", 4, {4, 0, 0}}};
  for (const int width : {1, 2}) {
    Box box{.dims = {8, 4, 4}};
    const std::string metadata = metadataText(
        bricks,
        fmt::format(R"("bytesPerPixel":{},"scale":[1,1.5,2],"endianness":"BIG_ENDIAN","globalSize":[8,8,8])", width));
    scratch.write("metadata.json", metadata);
    std::vector<std::string> files;
    for (const TestBrick& brick : bricks) {
      files.push_back(brickBytes(brick, width, true, box, random));
      scratch.write(brick.file, files.back());
    }
    survivesBreaking(scratch, "metadata.json", metadata);
    for (std::size_t i = 0; i < files.size(); ++i) survivesBreaking(scratch, bricks[i].file, files[i], "metadata.json");
    EXPECT_EQ(importAll(scratch.path("metadata.json")), box.bytes(width));
  }
}

TEST(ImportPrism, ABrickThatShrinksIsAnError) {
  const Scratch scratch;
  scratch.write("0.hz", std::string(512, 'a'));
  scratch.write("metadata.json", metadataText({{"0.hz", 8, {0, 0, 0}}}, kRest));
  const auto source = openSource({scratch.path("")}, {});
  std::filesystem::resize_file(scratch.path("0.hz"), 100);
  EXPECT_THROW(readAll(*source), DataError);
}

// Checksums of the voxels in rows, taken by another program from the format's description.
TEST(ImportPrism, RealSetsHaveTheVoxelsThatAnotherProgramReads) {
  const auto folder = realData();
  if (!folder) GTEST_SKIP() << "no real data: set BLOCKWALK_DATA to its folder";
  struct Set {
    const char* folder;
    glm::dvec3 spacing;
    glm::ivec3 dims;
    std::uint32_t crc;
  };
  const Set sets[] = {{"8-Bit_HZ_Box", {1, 1, 1}, {64, 64, 64}, 0x88fd7f21},
                      {"8-Bit_Raw_Box", {1, 1, 1}, {64, 64, 64}, 0x88fd7f21},
                      {"8-Bit_HZ_Bucky", {1, 1, 1}, {32, 32, 32}, 0x24f62b5c},
                      {"8-Bit_HZ_Cross", {1, 1, 1}, {64, 64, 64}, 0x665e90a7},
                      {"8-Bit_HZ_Daisy", {1, 1, 1}, {192, 192, 192}, 0xeeb1633c},
                      {"8-Bit_HZ_Hydrogen", {1, 1, 1}, {128, 128, 128}, 0x8f5b5595},
                      {"8-Bit_HZ_MRI_Woman", {1, 1, 1.5}, {256, 256, 128}, 0x08fe7550},
                      {"8-Bit_HZ_VisMaleOneBrick", {1.57774, 0.995861, 1.00797}, {128, 128, 128}, 0xddb339de},
                      {"8-Bit_Raw_multiBox", {1, 1, 1}, {128, 128, 128}, 0x160cb7a1}};
  for (const Set& set : sets) {
    const auto source = openSource({*folder / "prism" / set.folder}, {});
    EXPECT_EQ(source->info().dims, set.dims) << set.folder;
    EXPECT_EQ(source->info().name, set.folder);
    const std::string voxels = readAll(*source, 64);
    const auto* bytes = reinterpret_cast<const Bytef*>(voxels.data());
    EXPECT_EQ(crc32(0, bytes, static_cast<uInt>(voxels.size())), set.crc) << set.folder;
    for (int i = 0; i < 3; ++i) EXPECT_EQ(source->info().world_from_index[i][i], set.spacing[i]) << set.folder;
  }
}

}  // namespace
}  // namespace blockwalk
