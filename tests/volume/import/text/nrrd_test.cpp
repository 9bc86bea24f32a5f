// SPDX-License-Identifier: Apache-2.0
#include <sstream>

#include "tests/volume/import/import_scratch.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;

const std::string kSmall = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 1\nencoding: raw\n";

std::string nrrdHeader(const std::string& type, const std::string& sizes, const std::string& rest) {
  const auto axes = std::count(sizes.begin(), sizes.end(), ' ') + 1;
  return "NRRD0005\n# a comment\ntype: " + type + "\ndimension: " + std::to_string(axes) + "\nsizes: " + sizes + "\n" +
         rest + "\n";
}

glm::dvec3 worldOf(const Source& source, glm::dvec3 index) {
  return glm::dvec3(source.info().world_from_index * glm::dvec4(index, 1));
}

TEST(ImportNrrd, ReadsEveryTypeName) {
  struct Case {
    const char* names;  // separated by |
    std::size_t bytes;
    VoxelType type;
  };
  const Case cases[] = {{"signed char|int8|int8_t|uchar|unsigned char|uint8|uint8_t", 1, VoxelType::u8},
                        {"short|short int|signed short|signed short int|int16|int16_t", 2, VoxelType::u16},
                        {"ushort|unsigned short|unsigned short int|uint16|uint16_t", 2, VoxelType::u16},
                        {"int|signed int|int32|int32_t|uint|unsigned int|uint32|uint32_t|float", 4, VoxelType::f32},
                        {"longlong|long long|int64|ulonglong|unsigned long long|uint64_t|double", 8, VoxelType::f32}};
  const Scratch scratch;
  for (const Case& one : cases) {
    std::stringstream names(one.names);
    for (std::string name; std::getline(names, name, '|');) {
      const auto file = scratch.write(
          "a.nrrd", nrrdHeader(name, "2 1 1", "endian: little\nencoding: raw\n") + std::string(2 * one.bytes, '\0'));
      EXPECT_EQ(openSource({file}, {})->info().type, one.type) << name;
    }
  }
  EXPECT_THAT(refusal({scratch.write("b", nrrdHeader("block", "1 1 1", "encoding: raw\n"))}),
              HasSubstr("type: 'block'"));
}

TEST(ImportNrrd, ReadsRawAndGzipInBothByteOrders) {
  const Scratch scratch;
  const std::string voxels = bytesOf<std::uint16_t>({1, 2, 300, 4, 5, 60000});
  const std::string little = nrrdHeader("ushort", "3 1 2", "endian: little\nencoding: raw\n");
  const std::string big = nrrdHeader("ushort", "3 1 2", "endian: big\nencoding: gzip\n");
  EXPECT_EQ(importAll(scratch.write("a", little + voxels)), voxels);
  EXPECT_EQ(importAll(scratch.write("b", big + gzipped(swapped(voxels, 2)))), voxels);
  EXPECT_THAT(refusal({scratch.write("c", nrrdHeader("ushort", "3 1 2", "encoding: raw\n") + voxels)}),
              HasSubstr("endian"));
}

TEST(ImportNrrd, TellsSpaceAndUnits) {
  const Scratch scratch;
  const auto infoOf = [&](const std::string& fields) {
    return openSource({scratch.write("a.nrrd", nrrdHeader("uchar", "2 1 1", "encoding: raw\n" + fields) + "ab")}, {})
        ->info();
  };
  const SourceInfo known =
      infoOf("space: left-posterior-superior\nspace units: \"mm\" \"mm\" \"mm\"\nsample units: \"HU\"\n");
  EXPECT_EQ(known.space, "left-posterior-superior");
  EXPECT_EQ(known.length_unit, "mm");
  EXPECT_EQ(known.channels[0].unit, "HU");
  EXPECT_EQ(infoOf("units: \"um\" \"um\" \"um\"\n").length_unit, "um");
  EXPECT_EQ(infoOf("units: \"\" um ???\n").length_unit, "um");
  EXPECT_EQ(infoOf("space units: \"mm\" \"mm\" \"s\"\n").length_unit, "");
  EXPECT_EQ(infoOf("space units: \"mm\n").length_unit, "\"mm");
  EXPECT_EQ(infoOf("space: " + std::string(2000, 'x') + "\n").space, "");
}

TEST(ImportNrrd, TakesTheOriginAsTheFirstSamplesCentre) {
  const Scratch scratch;
  const std::string geometry =
      "space: left-posterior-superior\nspace directions: (0,2,0) (0,0,-3) (4,0,0)\n"
      "space origin: (10,20,30)\nencoding: raw\n";
  const auto source = openSource({scratch.write("a", nrrdHeader("uchar", "1 1 1", geometry) + "x")}, {});
  EXPECT_EQ(worldOf(*source, {0.5, 0.5, 0.5}), glm::dvec3(10, 20, 30));
  EXPECT_EQ(worldOf(*source, {1.5, 0.5, 0.5}), glm::dvec3(10, 22, 30));
  EXPECT_EQ(worldOf(*source, {0.5, 1.5, 2.5}), glm::dvec3(18, 20, 27));
  ImportOptions options;
  options.spacing = glm::dvec3(1, 1, 1);
  const auto other = openSource({scratch.path("a")}, options);
  EXPECT_EQ(worldOf(*other, {0.5, 0.5, 0.5}), glm::dvec3(10, 20, 30));
  EXPECT_EQ(worldOf(*other, {1.5, 0.5, 0.5}), glm::dvec3(10, 21, 30));
}

TEST(ImportNrrd, TakesSpacingsAndUnknownOnes) {
  const Scratch scratch;
  const auto source =
      openSource({scratch.write("a", nrrdHeader("uchar", "1 1 1", "spacings: 2 nan 0.5\nencoding: raw\n") + "x")}, {});
  EXPECT_EQ(worldOf(*source, {1, 1, 1}), glm::dvec3(2, 1, 0.5));
}

TEST(ImportNrrd, KnowsColourByItsKindOrByAFourthAxis) {
  const Scratch scratch;
  const std::string pixels = bytesOf<std::uint8_t>({1, 2, 3, 4, 5, 6, 7, 8});
  const auto rgba = scratch.write("a", nrrdHeader("uchar", "4 2 1 1",
                                                  "kinds: RGBA-color space space space\n"
                                                  "space directions: none (1,0,0) (0,1,0) (0,0,1)\nencoding: raw\n") +
                                           pixels);
  EXPECT_EQ(importAll(rgba), pixels);
  EXPECT_EQ(openSource({rgba}, {})->info().dims, glm::ivec3(2, 1, 1));
  const auto plain = scratch.write("b", nrrdHeader("uchar", "4 2 1 1", "encoding: raw\n") + pixels);
  EXPECT_EQ(openSource({plain}, {})->info().type, VoxelType::rgba8);
  const auto slices = scratch.write("c", nrrdHeader("uchar", "4 2 1", "encoding: raw\n") + pixels);
  EXPECT_EQ(openSource({slices}, {})->info().dims, glm::ivec3(4, 2, 1));
  const std::string floats = bytesOf<float>({1, 2, 3, 4, 5, 6, 7, 8});
  const auto scalars = scratch.write("d", nrrdHeader("float", "4 2 1 1", "endian: little\nencoding: raw\n") + floats);
  EXPECT_EQ(openSource({scalars}, {})->info().dims, glm::ivec3(4, 2, 1));
}

TEST(ImportNrrd, SkipsLinesAndBytes) {
  const Scratch scratch;
  const std::string skips = "line skip: 2\nbyte skip: 1\nencoding: ";
  EXPECT_EQ(importAll(scratch.write("a", nrrdHeader("uchar", "4 1 1", skips + "raw\n") + "one\ntwo\n#abcd")), "abcd");
  EXPECT_EQ(
      importAll(scratch.write("b", nrrdHeader("uchar", "4 1 1", skips + "gz\n") + "one\ntwo\n" + gzipped("#abcd"))),
      "abcd");
  const std::string last = "byte skip: -1\nencoding: ";
  EXPECT_EQ(importAll(scratch.write("c", nrrdHeader("uchar", "4 1 1", last + "raw\n") + "whatever abcd")), "abcd");
  EXPECT_EQ(importAll(scratch.write("d", nrrdHeader("uchar", "4 1 1", last + "gz\n") + gzipped("whatever abcd"))),
            "abcd");
  EXPECT_THAT(refusal({scratch.write("e", nrrdHeader("uchar", "4 1 1", "line skip: 9\nencoding: raw\n") + "a\nb\n")}),
              HasSubstr("line skip"));
}

TEST(ImportNrrd, ReadsTextAndChecksEachNumber) {
  const Scratch scratch;
  const std::string text = nrrdHeader("uchar", "3 1 1", "encoding: ascii\n");
  EXPECT_EQ(importAll(scratch.write("a", text + "1 2\n255\n")), bytesOf<std::uint8_t>({1, 2, 255}));
  EXPECT_THAT(refusal({scratch.write("b", text + "1 2 256")}), HasSubstr("value 2 is '256'"));
  EXPECT_THAT(refusal({scratch.write("c", text + "1 2 3 4")}), HasSubstr("3 values were declared, 4"));
  EXPECT_THAT(refusal({scratch.write("d", text + "1 2   ")}), HasSubstr("3 values were declared, 2"));
}

TEST(ImportNrrd, OpensDetachedDataAndTellsWhatLiesElsewhere) {
  const Scratch scratch;
  scratch.write("data/a.raw", "abcd");
  scratch.write("outside.raw", "efgh");
  std::filesystem::create_symlink(scratch.path("outside.raw"), scratch.path("data/link.raw"));
  const auto importing = [&](const std::string& name) {
    return scratch.write("data/h.nhdr", kSmall + "data file: " + name + "\n");
  };
  for (const char* name : {"a.raw", "./a.raw", "../data/a.raw"}) {
    EXPECT_EQ(importAll(importing(name)), "abcd");
    EXPECT_THAT(openSource({importing(name)}, {})->info().notes, testing::IsEmpty()) << name;
  }
  for (const std::string& name :
       {scratch.path("outside.raw").string(), std::string("../outside.raw"), std::string("link.raw")}) {
    EXPECT_EQ(importAll(importing(name)), "efgh");
    EXPECT_THAT(openSource({importing(name)}, {})->info().notes,
                testing::ElementsAre(HasSubstr("outside of its folder")));
  }
  for (const char* name : {"absent.raw", "/dev/zero", ".", "a%02d.raw 1 2 1"}) {
    EXPECT_THAT(refusal({importing(name)}), HasSubstr("data file")) << name;
  }
}

TEST(ImportNrrd, NamesTheFieldThatIsWrong) {
  const Scratch scratch;
  const std::pair<std::string, std::string> cases[] = {
      {"NRRD0009\ntype: uchar\n", "NRRD0001"},
      {"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 1\n\n", "encoding"},
      {"NRRD0004\ndimension: 3\nsizes: 2 2 1\nencoding: raw\n\nabcd", "type"},
      {"NRRD0004\ntype: uchar\nsizes: 2 2 1\nencoding: raw\n\nabcd", "dimension"},
      {"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2\nencoding: raw\n\nabcd", "sizes"},
      {"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 x\nencoding: raw\n\nabcd", "sizes"},
      {"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 -1\nencoding: raw\n\nabcd", "sizes"},
      {"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 99999999999999999999\nencoding: raw\n\nabcd", "sizes"},
      {"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 65536 65536 65536\nencoding: raw\n\nabcd", "sizes"},
      {"NRRD0004\ntype: uchar\ndimension: 5\nsizes: 2 2 2 2 2\nencoding: raw\n\nabcd", "dimension"},
      {"NRRD0004\ntype: uchar\ndimension: 17\nsizes: 1\nencoding: raw\n\nabcd", "dimension"},
      {kSmall + "\nabc", "sizes"},
      {kSmall + "encoding: raw\n\nabcd", "encoding"},
      {kSmall + "no field\n\nabcd", "no field"},
      {kSmall + "byte skip: -2\n\nabcd", "byte skip"},
      {kSmall + "spacings: 1 0 1\n\nabcd", "axis 1"},
      {kSmall + "space directions: (1,0,0) (2,0,0) (0,0,1)\n\nabcd", "space directions"},
      {kSmall + "space directions: (1,0,0) (0,1,0)\n\nabcd", "space directions"},
      {kSmall + "space directions: (1,0,0) (0,1,0) (0,0,inf)\n\nabcd", "space directions"},
      {kSmall + "space directions: (1,0,0) (0,1,0 (0,0,1)\n\nabcd", "space directions"},
      {kSmall + "space origin: (nan,0,0)\n\nabcd", "space origin"},
      {"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 1\nencoding: bzip2\n\nabcd", "bzip2 data is broken"},
      {"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 1\nencoding: zrl\n\nabcd", "encoding"},
      {"NRRD0004\n" + std::string(std::size_t{2} << 20, '#'), "header"},
  };
  for (const auto& [text, expected] : cases) {
    EXPECT_THAT(refusal({scratch.write("a.nrrd", text)}), HasSubstr(expected)) << text.substr(0, 200);
  }
}

TEST(ImportNrrd, RefusesEveryCutOfAFile) {
  const Scratch scratch;
  const std::string whole =
      nrrdHeader("ushort", "3 1 2", "endian: little\nspacings: 1 1 2\nencoding: raw\n") + std::string(12, 'v');
  ASSERT_EQ(importAll(scratch.write("whole", whole)), std::string(12, 'v'));
  for (std::size_t length = 0; length < whole.size(); ++length) {
    EXPECT_FALSE(refusal({scratch.write("cut", whole.substr(0, length))}).empty()) << length;
  }
}

// What export writes where a field cannot hold it.
TEST(ImportNrrd, TakesOurOwnKeys) {
  const Scratch scratch;
  const auto with = [&](const std::string& keys) {
    return scratch.write("a.nrrd",
                         "NRRD0005\ntype: short\ndimension: 4\nsizes: 1 1 1 2\nkinds: domain domain domain list\n"
                         "space origin: (0.5,100.5,0.5)\nendian: little\nencoding: raw\n" +
                             keys + "\nabcd");
  };
  const SourceInfo info = openSource({with("blockwalk.space:=of \\\\ mine\nblockwalk.length_unit:= a b \n"
                                           "blockwalk.corner:=0 100 1e-17\nblockwalk.channel.0.name:=one\n"
                                           "blockwalk.channel.1.unit:=HU\nblockwalk.channel.1.color:=0aff80\n"
                                           "blockwalk.channel.1.value_scale:=0.5\nblockwalk.channel.1.value_offset:=3\n"
                                           "blockwalk.channel.7.color:=nonsense\nkey:=value\n")},
                                     {})
                              ->info();
  EXPECT_EQ(info.space, "of \\ mine");
  EXPECT_EQ(info.length_unit, " a b ");
  EXPECT_EQ(info.channels[0].name, "one");
  EXPECT_EQ(info.channels[0].value_offset, -32768) << "of short";
  EXPECT_EQ(info.channels[1].unit, "HU");
  EXPECT_EQ(info.channels[1].color, (std::array<std::uint8_t, 3>{0x0a, 0xff, 0x80}));
  EXPECT_EQ(info.channels[1].value_scale, 0.5);
  EXPECT_EQ(info.channels[1].value_offset, 3 - 16384);
  EXPECT_EQ(info.world_from_index[3], glm::dvec4(0, 100, 1e-17, 1));
  EXPECT_EQ(openSource({with("blockwalk.corner:=0 99 1e-17\n")}, {})->info().world_from_index[3],
            glm::dvec4(0, 100, 0, 1))
      << "the origin has moved since";
  ImportOptions named;
  named.channel_names = {"a", "b"};
  EXPECT_EQ(openSource({with("blockwalk.channel.0.name:=one\n")}, named)->info().channels[0].name, "a");
  for (const char* bad : {"corner:=1 2", "corner:=1 2 inf", "channel.0.value_scale:=x", "channel.0.value_offset:=nan",
                          "channel.1.color:=12345", "channel.1.color:=12345g"}) {
    const std::string key = std::string(bad).substr(0, std::string(bad).find(':'));
    EXPECT_THAT(refusal({with("blockwalk." + std::string(bad) + "\n")}), HasSubstr("blockwalk." + key + ": "));
  }
  EXPECT_THAT(refusal({with("blockwalk.channel.1.unit:=" + std::string(1025, 'u') + "\n")}), HasSubstr("1025 bytes"));
}

}  // namespace
}  // namespace blockwalk
