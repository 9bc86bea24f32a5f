// SPDX-License-Identifier: Apache-2.0
#include "volume/export/brick_partition.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "volume/error.h"

namespace blockwalk {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// Counts that other writers came to.
TEST(BrickPartition, HasAsManyBricksAsItShould) {
  EXPECT_EQ(partitionBricks({192, 192, 192}, "").size(), 20u);
  EXPECT_EQ(partitionBricks({180, 150, 129}, "").size(), 20u);
  EXPECT_EQ(partitionBricks({384, 384, 256}, "").size(), 11u);
  EXPECT_EQ(partitionBricks({512, 512, 512}, "").size(), 8u);
}

TEST(BrickPartition, ListsBricksByTheirFirstCells) {
  EXPECT_THAT(partitionBricks({1, 1, 1}, ""), ElementsAre(BrickPlace{{0, 0, 0}, 64}));
  EXPECT_THAT(partitionBricks({129, 128, 65}, ""),
              ElementsAre(BrickPlace{{0, 0, 0}, 128}, BrickPlace{{128, 0, 0}, 64}, BrickPlace{{128, 64, 0}, 64},
                          BrickPlace{{128, 0, 64}, 64}, BrickPlace{{128, 64, 64}, 64}));
}

TEST(BrickPartition, RefusesMoreThanItsBound) {
  try {
    partitionBricks({65536, 65536, 65536}, "v.bwv");
    FAIL() << "not refused";
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("v.bwv: 65536 x 65536 x 65536 voxels are more than 65536 bricks"));
  }
}

// The octree of a real set of four bricks of 128, as it stands there.
TEST(BrickPartition, WritesTheOctreeThatOlderProgramsRead) {
  const std::string text = brickMetadata(partitionBricks({256, 256, 128}, ""), {250, 256, 128}, {1, 1, 1.5}, 1);
  EXPECT_EQ(
      text,
      R"({"minLevel":128,"maxLevel":128,"bricks":[{"filename":"0.hz","size":128,"position":[0,0,0]},)"
      R"({"filename":"1.hz","size":128,"position":[128,0,0]},{"filename":"2.hz","size":128,"position":[0,128,0]},)"
      R"({"filename":"3.hz","size":128,"position":[128,128,0]}],"octree":{"Children":[{"Value":0},{"Value":1},)"
      R"({"Value":2},{"Value":3},{"Value":-1},{"Value":-1},{"Value":-1},{"Value":-1}]},"totalBricks":4,)"
      R"("totalOctnodes":9,"bytesPerPixel":1,"scale":[1,1,1.5],"endianness":"BIG_ENDIAN",)"
      R"("globalSize":[256,256,128],"trueSize":[250,256,128]})");
}

TEST(BrickPartition, ALargeBrickIsInTheFirstOfItsLeaves) {
  const std::string text = brickMetadata(partitionBricks({192, 128, 128}, ""), {192, 128, 128}, {1, 1, 1}, 2);
  EXPECT_THAT(text, HasSubstr(R"("octree":{"Children":[{"Children":[{"Value":0},{"Value":-1},)"));
  EXPECT_THAT(text, HasSubstr(R"({"Children":[{"Value":1},{"Value":-1},{"Value":2},{"Value":-1},{"Value":3},)"));
  EXPECT_THAT(text, HasSubstr(R"("totalOctnodes":25)"));
  EXPECT_THAT(text, HasSubstr(R"("globalSize":[192,128,128])"));
}

}  // namespace
}  // namespace blockwalk
