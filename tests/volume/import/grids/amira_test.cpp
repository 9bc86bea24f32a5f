// SPDX-License-Identifier: Apache-2.0
#include <glm/glm.hpp>

#include "tests/volume/import/broken.h"

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

std::string amiraFile(const std::string& first, const std::string& field, const std::string& data,
                      const std::string& more = {}) {
  return "# " + first + "\n\ndefine Lattice 4 3 2\n\nParameters {\n    Units {\n        Coordinates \"um\"\n    }\n" +
         more +
         "    Content \"4x3x2 ushort, uniform coordinates\",\n    BoundingBox 10 16 20 21 -1 3,\n"
         "    CoordType \"uniform\"\n}\n\nLattice { " +
         field + "\n\n# Data section follows\n@1\n" + data + "\n";
}

std::string shorts(bool swap) {
  std::vector<std::uint16_t> values;
  for (int i = 0; i < 24; ++i) values.push_back(static_cast<std::uint16_t>(1000 * i));
  return swap ? swapped(bytesOf(values), 2) : bytesOf(values);
}

TEST(Amira, HasVoxelsPlaceAndUnit) {
  const Scratch scratch;
  for (const bool is_big : {false, true}) {
    const std::string first = is_big ? "AmiraMesh 3D BINARY 2.0" : "AmiraMesh BINARY-LITTLE-ENDIAN 2.1";
    const auto source = openSource({scratch.write("a.am", amiraFile(first, "ushort Data } @1", shorts(is_big)))}, {});
    EXPECT_EQ(source->info().format, "amira");
    EXPECT_EQ(source->info().dims, glm::ivec3(4, 3, 2));
    EXPECT_EQ(source->info().length_unit, "um");
    EXPECT_EQ(worldOf(source->info(), glm::dvec3(0.5)), glm::dvec3(10, 20, -1));
    EXPECT_EQ(worldOf(source->info(), {3.5, 2.5, 1.5}), glm::dvec3(16, 21, 3));
    EXPECT_EQ(readAll(*source), shorts(false));
    EXPECT_THAT(source->info().notes, IsEmpty());
  }
  const std::string text = "0 1 2 3 4 5 6 7 8 9 10 11\n12 13 14 15 16 17 18 19 20 21 22 23";
  std::string counted;
  for (char i = 0; i < 24; ++i) counted += i;
  EXPECT_EQ(importAll(scratch.write("a.am", amiraFile("AmiraMesh ASCII 1.0", "byte Data } = @1", text))), counted);
}

TEST(Amira, UnpacksZipAndRuns) {
  const Scratch scratch;
  const std::string zip = gzipped(shorts(false), MAX_WBITS);
  const std::string little = "Avizo BINARY-LITTLE-ENDIAN 2.1";
  const auto packedAs = [&](const std::string& type, const std::string& how, const std::string& bytes) {
    return scratch.write(
        "a.am", amiraFile(little, type + " Data } @1(" + how + "," + std::to_string(bytes.size()) + ")", bytes));
  };
  EXPECT_EQ(importAll(packedAs("ushort", "HxZip", zip)), shorts(false));
  const std::string runs =
      "\x0f"
      "a"
      "\x83"
      "bcd"
      "\x06"
      "e";
  EXPECT_EQ(importAll(packedAs("byte", "HxByteRLE", runs)), std::string(15, 'a') + "bcd" + "eeeeee");
  EXPECT_THAT(refusal({packedAs("byte", "HxByteRLE",
                                runs + "\x01"
                                       "f")}),
              HasSubstr("Data: HxByteRLE: 10 bytes do not unpack to 24"));
  EXPECT_THAT(refusal({packedAs("byte", "HxByteRLE", "\x0f")}), HasSubstr("do not unpack to 24"));
  EXPECT_THAT(refusal({packedAs("byte", "HxZip", zip)}), HasSubstr("HxZip"));
  EXPECT_THAT(refusal({packedAs("byte", "HxDeflate", zip)}),
              HasSubstr("packed by 'HxDeflate', which cannot be undone"));
}

TEST(Amira, MaterialsAreLabels) {
  const Scratch scratch;
  const auto source = openSource(
      {scratch.write("a.am", amiraFile("AmiraMesh BINARY-LITTLE-ENDIAN 2.1", "byte Labels } @1", std::string(24, '\1'),
                                       "    Materials {\n        Exterior {\n            Id 1\n        }\n        Bone "
                                       "{\n            Color 1 0.5 0,\n            Id 2\n        }\n    }\n"))},
      {});
  const SourceChannel& channel = source->info().channels[0];
  EXPECT_TRUE(channel.is_labels);
  ASSERT_EQ(channel.labels.size(), 2u);
  EXPECT_EQ(channel.labels[0].name, "Exterior");
  EXPECT_EQ(channel.labels[1].value, 1);
  EXPECT_EQ(channel.labels[1].name, "Bone");
  EXPECT_EQ(channel.labels[1].color, (Color{255, 128, 0}));
}

TEST(Amira, VectorsAreChannels) {
  const Scratch scratch;
  std::vector<float> values;
  for (int i = 0; i < 48; ++i) values.push_back(static_cast<float>(i) / 2);
  const auto source = openSource(
      {scratch.write("a.am", amiraFile("AmiraMesh BINARY-LITTLE-ENDIAN 2.1", "float[2] Flow } @1", bytesOf(values)))},
      {});
  EXPECT_EQ(source->info().channels.size(), 2u);
  std::vector<float> wanted;
  for (std::size_t i = 0; i < 48; ++i) wanted.push_back(values[i < 24 ? 2 * i : 2 * (i - 24) + 1]);
  EXPECT_EQ(readAll(*source), bytesOf(wanted));
}

TEST(Amira, BrokenHeadersAreRefusedByNameAndBound) {
  const Scratch scratch;
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string file = amiraFile("AmiraMesh BINARY-LITTLE-ENDIAN 2.1", "ushort Data } @1", shorts(false));
    return refusal({scratch.write("a.am", file.replace(file.find(from), from.size(), to))});
  };
  EXPECT_THAT(with("4 3 2", "4 3"), HasSubstr("a.am: define Lattice: three sizes are missing"));
  EXPECT_THAT(with("4 3 2", "4 3 70000"), HasSubstr("define Lattice: 70000 is outside 1..65536"));
  EXPECT_THAT(with("4 3 2", "4 3 6000"), HasSubstr("144000 bytes of voxels from byte"));
  EXPECT_THAT(with("\"uniform\"", "\"curvilinear\""), HasSubstr("CoordType: 'curvilinear' cannot be read"));
  EXPECT_THAT(with("10 16 20", "10 16 x"), HasSubstr("BoundingBox: 'x' is no finite number"));
  EXPECT_THAT(with("10 16 20", "10 10 20"), HasSubstr("BoundingBox: the step along axis 0 has length 0"));
  EXPECT_THAT(with("ushort Data", "complex Data"), HasSubstr("Data: type 'complex' cannot be read"));
  EXPECT_THAT(with("ushort Data", "ushort[9] Data"), HasSubstr("Data: 9 components a voxel, must be 1..4"));
  EXPECT_THAT(with("\n@1\n", "\n"), HasSubstr("no data follow the header"));
  EXPECT_THAT(with(
                  "Units {", std::string("Units {\n") +
                                 [] {
                                   std::string deep;
                                   for (int i = 0; i < 40; ++i) deep += "a {\n";
                                   return deep;
                                 }()),
              HasSubstr("nested more than 32 times"));
}

TEST(Amira, SurvivesBreaking) {
  const Scratch scratch;
  const std::string zip = gzipped(shorts(false), MAX_WBITS);
  survivesBreaking(scratch, "a.am",
                   amiraFile("AmiraMesh BINARY-LITTLE-ENDIAN 2.1",
                             "ushort Data } @1(HxZip," + std::to_string(zip.size()) + ")", zip));
}

}  // namespace
}  // namespace blockwalk::volume_test
