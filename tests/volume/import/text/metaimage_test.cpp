// SPDX-License-Identifier: Apache-2.0
#include "tests/volume/import/import_scratch.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;

std::string metaHeader(const std::string& type, const std::string& dims, const std::string& rest,
                       const std::string& data_file = "LOCAL") {
  return "ObjectType = Image\nNDims = 3\nDimSize = " + dims + "\nElementType = " + type + "\n" + rest +
         "ElementDataFile = " + data_file + "\n";
}

TEST(ImportMetaImage, ReadsLocalDataInBothByteOrders) {
  const Scratch scratch;
  const std::string voxels = bytesOf<std::uint16_t>({1, 2, 300, 4, 5, 60000});
  EXPECT_EQ(importAll(scratch.write("a", metaHeader("MET_USHORT", "3 1 2", "") + voxels)), voxels);
  EXPECT_EQ(importAll(scratch.write(
                "b", metaHeader("MET_USHORT", "3 1 2", "BinaryDataByteOrderMSB = True\n") + swapped(voxels, 2))),
            voxels);
  EXPECT_EQ(importAll(scratch.write(
                "c", metaHeader("MET_USHORT", "3 1 2", "ElementByteOrderMSB = True\n") + swapped(voxels, 2))),
            voxels);
}

TEST(ImportMetaImage, TellsTheUnitOfLength) {
  const Scratch scratch;
  const auto unitOf = [&](const std::string& rest) {
    return openSource({scratch.write("a", metaHeader("MET_UCHAR", "2 2 2", rest) + "abcdefgh")}, {})
        ->info()
        .length_unit;
  };
  EXPECT_EQ(unitOf("DistanceUnits = mm\n"), "mm");
  EXPECT_EQ(unitOf("DistanceUnits = um\n"), "um");
  EXPECT_EQ(unitOf("DistanceUnits = ?\n"), "");
  EXPECT_EQ(unitOf("DistanceUnits = " + std::string(65, 'm') + "\n"), "");
  EXPECT_EQ(unitOf(""), "");
}

TEST(ImportMetaImage, ReadsCompressedData) {
  const Scratch scratch;
  const std::string zlib = gzipped("abcdefgh", MAX_WBITS);
  const auto whole = scratch.write("a", metaHeader("MET_UCHAR", "2 2 2", "CompressedData = True\n") + zlib);
  EXPECT_EQ(importAll(whole), "abcdefgh");
  scratch.write("b.zraw", zlib);
  EXPECT_EQ(importAll(scratch.write("b.mhd", metaHeader("MET_UCHAR", "2 2 2", "CompressedData = True\n", "b.zraw"))),
            "abcdefgh");
  EXPECT_THAT(refusal({scratch.write("c", metaHeader("MET_UCHAR", "2 2 3", "CompressedData = True\n") + zlib)}),
              AllOf(HasSubstr("8 bytes"), HasSubstr("12 were declared")));
  EXPECT_THAT(refusal({scratch.write("d", metaHeader("MET_UCHAR", "2 2 1", "CompressedData = True\n") + zlib)}),
              AllOf(HasSubstr("8 bytes"), HasSubstr("4 were declared")));
}

TEST(ImportMetaImage, TakesMatrixSpacingAndOffset) {
  const Scratch scratch;
  const std::string geometry = "TransformMatrix = 0 1 0 0 0 1 1 0 0\nOffset = 10 20 30\nElementSpacing = 2 3 4\n";
  const auto source = openSource({scratch.write("a", metaHeader("MET_UCHAR", "1 1 1", geometry) + "x")}, {});
  const glm::dmat4 world = source->info().world_from_index;
  EXPECT_EQ(glm::dvec3(world * glm::dvec4(0.5, 0.5, 0.5, 1)), glm::dvec3(10, 20, 30));
  EXPECT_EQ(glm::dvec3(world * glm::dvec4(1.5, 0.5, 0.5, 1)), glm::dvec3(10, 22, 30));
  EXPECT_EQ(glm::dvec3(world * glm::dvec4(0.5, 0.5, 1.5, 1)), glm::dvec3(14, 20, 30));
}

TEST(ImportMetaImage, ReadsColourTextAndHeaderSize) {
  const Scratch scratch;
  const std::string pixels = bytesOf<std::uint8_t>({1, 2, 3, 4, 5, 6, 7, 8});
  EXPECT_EQ(importAll(scratch.write("a", metaHeader("MET_UCHAR", "2 1 1", "ElementNumberOfChannels = 4\n") + pixels)),
            pixels);
  EXPECT_EQ(importAll(scratch.write("b", metaHeader("MET_SHORT", "2 1 1", "BinaryData = False\n") + "-5 7\n")),
            bytesOf<std::uint16_t>({32763, 32775}));
  scratch.write("c.raw", "header" + pixels);
  EXPECT_EQ(importAll(scratch.write("c.mhd", metaHeader("MET_UCHAR", "8 1 1", "HeaderSize = -1\n", "c.raw"))), pixels);
  EXPECT_EQ(importAll(scratch.write("d.mhd", metaHeader("MET_UCHAR", "8 1 1", "HeaderSize = 6\n", "c.raw"))), pixels);
}

TEST(ImportMetaImage, NamesTheFieldThatIsWrong) {
  const Scratch scratch;
  const std::pair<std::string, std::string> cases[] = {
      {metaHeader("MET_UCHAR", "2 2 1", "") + "abc", "DimSize"},
      {metaHeader("MET_UCHAR", "2 2", "") + "abcd", "DimSize"},
      {metaHeader("MET_UCHAR", "2 2 70000", "") + "abcd", "DimSize"},
      {metaHeader("MET_UCHAR", "2 2 x", "") + "abcd", "DimSize"},
      {metaHeader("MET_STRING", "2 2 1", "") + "abcd", "ElementType"},
      {metaHeader("MET_UCHAR", "2 2 1", "ElementNumberOfChannels = 5\n") + "abcdabcd", "ElementNumberOfChannels"},
      {metaHeader("MET_UCHAR", "2 2 1", "ElementNumberOfChannels = 0\n") + "abcdabcd", "ElementNumberOfChannels"},
      {metaHeader("MET_UCHAR", "2 2 1", "ElementSpacing = 1 1\n") + "abcd", "ElementSpacing"},
      {metaHeader("MET_UCHAR", "2 2 1", "ElementSpacing = 1 0 1\n") + "abcd", "axis 1"},
      {metaHeader("MET_UCHAR", "2 2 1", "TransformMatrix = 1 0 0 1 0 0 0 0 1\n") + "abcd", "TransformMatrix"},
      {metaHeader("MET_UCHAR", "2 2 1", "Offset = 1 nan 0\n") + "abcd", "Offset"},
      {metaHeader("MET_UCHAR", "2 2 1", "CompressedData = maybe\n") + "abcd", "CompressedData"},
      {metaHeader("MET_UCHAR", "2 2 1", "HeaderSize = -3\n") + "abcd", "HeaderSize"},
      {metaHeader("MET_UCHAR", "2 2 1", "HeaderSize = 9000\n", "x.mhd"), "DimSize"},
      {metaHeader("MET_UCHAR", "2 2 1", "DimSize = 2 2 1\n") + "abcd", "DimSize"},
      {metaHeader("MET_UCHAR", "2 2 1", "", "../absent.raw"), "ElementDataFile"},
      {metaHeader("MET_UCHAR", "2 2 1", "", "/dev/zero"), "ElementDataFile"},
      {metaHeader("MET_UCHAR", "2 2 1", "", "LIST"), "ElementDataFile"},
      {"ObjectType = Image\nNDims = 3\nDimSize = 2 2 1\nElementType = MET_UCHAR\n", "ElementDataFile"},
      {"ObjectType = Mesh\nNDims = 3\nElementDataFile = LOCAL\n", "ObjectType"},
      {"ObjectType = Image\nNDims = 11\nElementDataFile = LOCAL\n", "NDims"},
  };
  for (const auto& [text, expected] : cases) {
    EXPECT_THAT(refusal({scratch.write("folder/x.mhd", text)}), HasSubstr(expected)) << text;
  }
}

}  // namespace
}  // namespace blockwalk
