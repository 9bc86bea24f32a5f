// SPDX-License-Identifier: Apache-2.0
// Headers that name several data files, and what NRRD and MetaImage say besides of place, values and spaces.
#include <bzlib.h>

#include "tests/volume/import/import_scratch.h"
#include "volume/formats/world_space.h"

namespace blockwalk {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string nrrdOf(const std::string& sizes, const std::string& rest) {
  const auto axes = std::count(sizes.begin(), sizes.end(), ' ') + 1;
  return "NRRD0005\ntype: uchar\ndimension: " + std::to_string(axes) + "\nsizes: " + sizes + "\n" + rest;
}

std::string metaOf(const std::string& dims, const std::string& rest) {
  const auto axes = std::count(dims.begin(), dims.end(), ' ') + 1;
  return "ObjectType = Image\nNDims = " + std::to_string(axes) + "\nDimSize = " + dims + "\nElementType = MET_UCHAR\n" +
         rest;
}

std::string bzipped(std::string bytes) {
  std::string packed(bytes.size() + 1000, '\0');
  auto size = static_cast<unsigned>(packed.size());
  BZ2_bzBuffToBuffCompress(packed.data(), &size, bytes.data(), static_cast<unsigned>(bytes.size()), 9, 0, 0);
  packed.resize(size);
  return packed;
}

TEST(ImportDataFiles, AreListedOrNumbered) {
  const Scratch scratch;
  for (int i = 0; i < 3; ++i) {
    const std::string part(4, static_cast<char>('a' + i));
    scratch.write("p" + std::to_string(i) + ".raw", part);
    scratch.write("s" + std::to_string(7 + 2 * i) + ".gz", gzipped(part));
    scratch.write("n 00" + std::to_string(i) + ".raw", "##" + part);
    scratch.write("t" + std::to_string(i) + ".txt", "1 2 3 " + std::to_string(i));
  }
  const std::string all = "aaaabbbbcccc";
  const auto nrrd = [&](const std::string& rest) { return scratch.write("h.nhdr", nrrdOf("2 2 3", rest)); };
  EXPECT_EQ(importAll(nrrd("encoding: raw\ndata file: LIST\np0.raw\np1.raw\np2.raw\n")), all);
  EXPECT_EQ(importAll(nrrd("encoding: raw\ndata file: LIST 2\n./p0.raw\np1.raw\r\np2.raw")), all);
  EXPECT_EQ(importAll(nrrd("encoding: raw\ndata file: p%d.raw 0 2 1\n")), all);
  EXPECT_EQ(importAll(nrrd("encoding: raw\ndata file: p%d.raw 2 0 -1 2\n")), "ccccbbbbaaaa");
  EXPECT_EQ(importAll(nrrd("encoding: gzip\ndata file: s%01d.gz 7 11 2\n")), all);
  EXPECT_EQ(importAll(nrrd("encoding: raw\nbyte skip: 2\ndata file: n %03d.raw 0 2 1\n")), all);
  EXPECT_EQ(importAll(nrrd("encoding: raw\nbyte skip: -1\ndata file: n %03d.raw 0 2 1\n")), all);
  EXPECT_EQ(importAll(nrrd("encoding: ascii\ndata file: t%d.txt 0 2 1\n")),
            std::string("\1\2\3\0\1\2\3\1\1\2\3\2", 12));
  // Rows of a file's own, and files on two axes.
  EXPECT_EQ(importAll(scratch.write("r.nhdr", nrrdOf("4 3 1", "encoding: raw\ndata file: p%d.raw 0 2 1 1\n"))), all);
  const auto meta = [&](const std::string& rest) { return scratch.write("h.mhd", metaOf("2 2 3", rest)); };
  EXPECT_EQ(importAll(meta("ElementDataFile = LIST\np0.raw\np1.raw\np2.raw\n")), all);
  EXPECT_EQ(importAll(meta("ElementDataFile = LIST 2D\np0.raw\np1.raw\np2.raw\n")), all);
  EXPECT_EQ(importAll(meta("ElementDataFile = p%d.raw 0 2 1\n")), all);
  EXPECT_EQ(importAll(meta("HeaderSize = 2\nElementDataFile = n %03d.raw 0 2 1\n")), all);
  EXPECT_EQ(importAll(meta("HeaderSize = -1\nElementDataFile = n %03d.raw 0 2 1\n")), all);
  EXPECT_EQ(importAll(meta("CompressedData = True\nElementDataFile = s%d.gz 7 11 2\n")), all);
  EXPECT_EQ(importAll(meta("BinaryData = False\nElementDataFile = t%d.txt 0 2 1\n")),
            std::string("\1\2\3\0\1\2\3\1\1\2\3\2", 12));
  // A name with a percent sign is a name.
  scratch.write("50 %d 1 2 3", all);
  EXPECT_EQ(importAll(meta("ElementDataFile = 50 %d 1 2 3\n")), all);

  const std::pair<std::string, const char*> refused[] = {
      {nrrdOf("2 2 3", "encoding: raw\ndata file: LIST\np0.raw\np1.raw\n"), "2 files are listed, the sizes need 3"},
      {nrrdOf("2 2 3", "encoding: raw\ndata file: LIST 9\np0.raw\n"), "a file of 9 axes"},
      {nrrdOf("2 2 3", "encoding: raw\ndata file: LIST two\np0.raw\n"), "no number of axes"},
      {nrrdOf("2 2 3", "encoding: raw\ndata file: p%d.raw 0 3 1\n"), "4 files are named, the sizes need 3"},
      {nrrdOf("2 2 3", "encoding: raw\ndata file: p%d.raw 0 2 0\n"), "there are no files"},
      {nrrdOf("2 2 3", "encoding: raw\ndata file: p%d.raw 9223372036854775807 1 -1\n"), "outside -2^40"},
      {nrrdOf("2 2 3", "encoding: raw\ndata file: q%d.raw 0 2 1\n"), "q0.raw"},
      {nrrdOf("2 3 3", "encoding: raw\ndata file: p%d.raw 0 2 1\n"), "6 bytes of voxels are declared, 4 are there"},
      {metaOf("2 2 3", "ElementDataFile = LIST\np0.raw\np1.raw\n"), "2 files are listed, DimSize needs 3"},
  };
  for (const auto& [text, message] : refused)
    EXPECT_THAT(refusal({scratch.write("x", text)}), HasSubstr(message)) << text;
}

TEST(ImportDataFiles, ManyAreReadInAnyOrder) {
  const Scratch scratch;
  std::string all;
  for (int i = 0; i < 40; ++i) {
    const std::string part(6, static_cast<char>('0' + i));
    scratch.write("p" + std::to_string(i), part);
    all += part;
  }
  const auto source = openSource({scratch.write("h", nrrdOf("3 2 40", "encoding: raw\ndata file: p%d 0 39 1\n"))}, {});
  EXPECT_TRUE(source->info().random_access);
  for (const int z : {39, 0, 17}) {
    std::string slice(6, '\0');
    source->another()->readRows(z, 0, 2, std::as_writable_bytes(std::span(slice)));
    EXPECT_EQ(slice, all.substr(static_cast<std::size_t>(z) * 6, 6));
  }
}

TEST(ImportDataFiles, WhatLiesBehindIsTold) {
  const Scratch scratch;
  const std::string voxels(80, 'v');
  const auto notesOf = [&](const std::string& text) {
    const auto source = openSource({scratch.write("a", text)}, {});
    EXPECT_EQ(readAll(*source), voxels);
    return source->info().notes;
  };
  const std::string raw = nrrdOf("4 4 5", "encoding: raw\n\n");
  const std::string gz = nrrdOf("4 4 5", "encoding: gzip\n\n");
  EXPECT_THAT(notesOf(raw + voxels), IsEmpty());
  EXPECT_THAT(notesOf(raw + voxels + "\n"), ElementsAre(HasSubstr("1 bytes behind the voxels")));
  EXPECT_THAT(notesOf(gz + gzipped(voxels)), IsEmpty());
  EXPECT_THAT(notesOf(gz + gzipped(voxels) + "\n"), ElementsAre(HasSubstr("1 bytes follow the end of the compressed")));
  EXPECT_THAT(notesOf(gz + gzipped(voxels + "\n")), ElementsAre(HasSubstr("unpacks to 81 bytes, 80 were declared")));
  EXPECT_THAT(notesOf(nrrdOf("4 4 5", "encoding: bz2\n\n") + bzipped(voxels)), IsEmpty());
  EXPECT_THAT(notesOf(metaOf("4 4 5", "ElementDataFile = LOCAL\n") + voxels + "12"), ElementsAre(HasSubstr("2 bytes")));
  EXPECT_THAT(refusal({scratch.write("b", gz + gzipped(voxels + voxels))}), HasSubstr("160 bytes, 80 were declared"));
  EXPECT_THAT(refusal({scratch.write("c", nrrdOf("4 4 5", "encoding: bzip2\n\n") + bzipped(voxels).substr(0, 30))}),
              HasSubstr("cut off"));
}

TEST(ImportDataFiles, HexAndBzip2AreRead) {
  const Scratch scratch;
  const std::string words = "NRRD0005\ntype: ushort\ndimension: 1\nsizes: 3\nendian: big\n";
  EXPECT_EQ(importAll(scratch.write("a", words + "encoding: hex\n\n0001 fFfe\n12 34\n")),
            bytesOf<std::uint16_t>({1, 0xfffe, 0x1234}));
  EXPECT_THAT(refusal({scratch.write("b", words + "encoding: hex\n\n0001fffe12")}), HasSubstr("6 bytes were declared"));
  EXPECT_THAT(refusal({scratch.write("c", words + "encoding: hex\n\n0001fffe1g34")}), HasSubstr("digit 9"));
  EXPECT_THAT(refusal({scratch.write("d", words + "encoding: hex\n\n0001fffe123456")}), HasSubstr("14 hexadecimal"));
  const std::string bytes = swapped(bytesOf<std::uint16_t>({1, 300, 60000}), 2);
  EXPECT_EQ(importAll(scratch.write("e", words + "encoding: bzip2\n\n" + bzipped(bytes))),
            bytesOf<std::uint16_t>({1, 300, 60000}));
  EXPECT_EQ(importAll(scratch.write("f", words + "encoding: bz2\nbyte skip: -1\n\n" + bzipped("head" + bytes))),
            bytesOf<std::uint16_t>({1, 300, 60000}));
  const std::string ints = "NRRD0005\ntype: short\ndimension: 1\nsizes: 4\nencoding: ascii\n\n";
  EXPECT_EQ(importAll(scratch.write("g", ints + "+1, -2.0,3e2 0")),
            bytesOf<std::uint16_t>({32769, 32766, 33068, 32768}));
  EXPECT_THAT(refusal({scratch.write("h", ints + "1 2.5 3 4")}), HasSubstr("value 1 is '2.5'"));
  EXPECT_THAT(refusal({scratch.write("i", ints + "1 +-2 3 4")}), HasSubstr("value 1 is '+-2'"));
}

TEST(ImportNrrdAxes, OfLengthOneSayNothing) {
  const Scratch scratch;
  const std::string voxels = "abcdefghijkl";
  const auto dimsOf = [&](const std::string& sizes, const std::string& rest) {
    const auto source = openSource({scratch.write("a", nrrdOf(sizes, rest + "encoding: raw\n\n") + voxels)}, {});
    EXPECT_EQ(readAll(*source), voxels);
    return source->info().dims;
  };
  EXPECT_EQ(dimsOf("2 3 2 1", ""), glm::ivec3(2, 3, 2));
  EXPECT_EQ(dimsOf("1 2 3 2", "kinds: list domain domain domain\n"), glm::ivec3(2, 3, 2));
  EXPECT_EQ(dimsOf("1 2 3 2", "space: RAS\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\n"), glm::ivec3(2, 3, 2));
  EXPECT_EQ(dimsOf("2 3 1 2 1 1", ""), glm::ivec3(2, 3, 2));
  EXPECT_EQ(dimsOf("2 3 2 1",
                   "space: right-anterior-superior-time\nspace directions: (1,0,0,0) (0,1,0,0) (0,0,1,0) "
                   "(0,0,0,1)\nspace origin: (1,2,3,4)\n"),
            glm::ivec3(2, 3, 2));
  EXPECT_EQ(dimsOf("12 1 1", ""), glm::ivec3(12, 1, 1));
}

TEST(ImportNrrdAxes, AFourthIsOfFrames) {
  const Scratch scratch;
  const auto raw =
      scratch.write("a", nrrdOf("2 2 1 3", "kinds: space space space time\nencoding: raw\n\n") + "aaaabbbbcccc");
  const auto gz =
      scratch.write("b", nrrdOf("2 1 2 3", "space directions: (1,0,0) (0,1,0) (0,0,1) none\nencoding: gzip\n\n") +
                             gzipped("aaaabbbbcccc"));
  const auto meta = scratch.write("c", metaOf("2 2 1 3", "ElementDataFile = LOCAL\n") + "aaaabbbbcccc");
  ImportOptions options;
  for (const auto& file : {raw, gz, meta}) {
    options.frame.reset();
    EXPECT_EQ(importAll(file), "aaaa");
    EXPECT_THAT(openSource({file}, {})->info().notes, ElementsAre(HasSubstr("it is the first; --frame")));
    for (int frame = 0; frame < 3; ++frame) {
      options.frame = frame;
      EXPECT_EQ(importAll(file, options), std::string(4, static_cast<char>('a' + frame)));
      EXPECT_THAT(openSource({file}, options)->info().notes, ElementsAre(HasSubstr("of 3 volumes")));
    }
    options.frame = 3;
    EXPECT_THAT(refusal({file}, options), HasSubstr("--frame 3 is outside 0..2"));
  }
}

TEST(ImportNrrdSpace, IsAlwaysRightHanded) {
  struct Space {
    const char* said;
    const char* name;
    bool is_left;
  };
  for (const Space& space : {Space{"right-anterior-superior", "right-anterior-superior", false},
                             Space{"RAS", "right-anterior-superior", false},
                             Space{"LPS", "left-posterior-superior", false},
                             Space{"LPST", "left-posterior-superior", false},
                             Space{"left-posterior-superior-time", "left-posterior-superior", false},
                             Space{"LAS", "right-anterior-superior", true},
                             Space{"LAST", "right-anterior-superior", true},
                             Space{"Left-Anterior-Superior", "right-anterior-superior", true},
                             Space{"left-anterior-superior-time", "right-anterior-superior", true},
                             Space{"right-posterior-superior", "left-posterior-superior", true},
                             Space{"right-anterior-inferior", "left-anterior-inferior", true},
                             Space{"left-anterior-inferior", "left-anterior-inferior", false},
                             Space{"anterior-right-superior", "posterior-right-superior", true},
                             Space{"anterior-superior-right", "anterior-superior-right", false},
                             Space{"3D-left-handed", "3D-right-handed", true},
                             Space{"3D-left-handed-time", "3D-right-handed", true},
                             Space{"3D-right-handed", "3D-right-handed", false},
                             Space{"scanner-xyz", "scanner-xyz", false},
                             Space{"right-right-superior", "right-right-superior", false},
                             Space{"my bench", "my bench", false}}) {
    EXPECT_EQ(worldSpace(space.said).name, space.name) << space.said;
    EXPECT_EQ(worldSpace(space.said).is_left_handed, space.is_left) << space.said;
  }
  const Scratch scratch;
  const auto source = openSource({scratch.write("a", nrrdOf("1 1 1",
                                                            "space: LAS\nspace directions: (0,2,0) (3,0,0) (0,0,4)\n"
                                                            "space origin: (10,20,30)\nencoding: raw\n\nx"))},
                                 {});
  const glm::dmat4& world = source->info().world_from_index;
  EXPECT_EQ(glm::dvec3(world * glm::dvec4(0.5, 0.5, 0.5, 1)), glm::dvec3(-10, 20, 30));
  EXPECT_EQ(glm::dvec3(world[1]), glm::dvec3(-3, 0, 0));
  EXPECT_THAT(source->info().notes, ElementsAre(HasSubstr("LAS is left-handed")));
}

TEST(ImportNrrdSpace, EndsOfAxesArePlaceAndSpacing) {
  const Scratch scratch;
  const auto worldOf = [&](const std::string& rest) {
    return openSource({scratch.write("a", nrrdOf("2 4 5", rest + "encoding: raw\n\n") + std::string(40, 'v'))}, {})
        ->info()
        .world_from_index;
  };
  const glm::dmat4 nodes = worldOf("axis mins: 0 10 -2\naxis maxs: 1 13 2\n");
  EXPECT_EQ(glm::dvec3(nodes * glm::dvec4(0.5, 0.5, 0.5, 1)), glm::dvec3(0, 10, -2));
  EXPECT_EQ(glm::dvec3(nodes * glm::dvec4(1.5, 3.5, 4.5, 1)), glm::dvec3(1, 13, 2));
  const glm::dmat4 cells = worldOf("axis mins: 0 10 -2\naxis maxs: 1 13 2\ncenters: cell cell cell\n");
  EXPECT_EQ(glm::dvec3(cells * glm::dvec4(0, 0, 0, 1)), glm::dvec3(0, 10, -2));
  EXPECT_EQ(glm::dvec3(cells * glm::dvec4(2, 4, 5, 1)), glm::dvec3(1, 13, 2));
}

TEST(ImportMetaImageValues, TakeSlopeAndOffset) {
  const Scratch scratch;
  const auto channelOf = [&](const std::string& slope, const std::string& type) {
    const auto source = openSource(
        {scratch.write("a", "ObjectType = Image\nNDims = 1\nDimSize = 2\nElementType = " + type +
                                "\nElementToIntensityFunctionSlope = " + slope +
                                "\nElementToIntensityFunctionOffset = 5\nElementDataFile = LOCAL\n\x01\x02")},
        {});
    const std::string voxels = readAll(*source);
    const SourceChannel& channel = source->info().channels[0];
    EXPECT_GT(channel.value_scale, 0);
    return channel.value_offset + channel.value_scale * static_cast<unsigned char>(voxels[1]);
  };
  EXPECT_EQ(channelOf("0.5", "MET_UCHAR"), 6);
  EXPECT_EQ(channelOf("-3", "MET_UCHAR"), -1);
  EXPECT_EQ(channelOf("-3", "MET_CHAR"), -1);
  EXPECT_EQ(channelOf("2", "MET_CHAR_ARRAY"), 9);
}

}  // namespace
}  // namespace blockwalk
