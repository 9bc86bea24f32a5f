// SPDX-License-Identifier: Apache-2.0
#include "volume/volume.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <tuple>

namespace blockwalk {
namespace {

std::uint64_t slowMorton(glm::uvec3 p) {
  std::uint64_t code = 0;
  for (int bit = 0; bit < 21; ++bit) {
    for (int axis = 0; axis < 3; ++axis) code |= (std::uint64_t{p[axis]} >> bit & 1) << (3 * bit + axis);
  }
  return code;
}

TEST(Volume, MortonCodeInterleavesBits) {
  std::mt19937 random(1);
  EXPECT_EQ(mortonCode({1, 0, 0}), 1u);
  EXPECT_EQ(mortonCode({0, 1, 0}), 2u);
  EXPECT_EQ(mortonCode({0, 0, 1}), 4u);
  for (int i = 0; i < 2000; ++i) {
    const glm::uvec3 p(random() & 0x1fffff, random() & 0x1fffff, random() & 0x1fffff);
    EXPECT_EQ(mortonCode(p), slowMorton(p));
  }
  EXPECT_EQ(mortonCode(glm::uvec3(0x1fffff)), 0x7fffffffffffffffu);
}

TEST(Volume, NeighboursAreCompleteAndSymmetric) {
  std::mt19937 random(2);
  for (unsigned side : {1u, 2u, 5u, 13u, 40u}) {
    for (unsigned percent : {3u, 30u, 100u}) {
      std::vector<Block> blocks;
      for (unsigned i = 0; i < side * side * side; ++i) {
        if (random() % 100 >= percent) continue;
        Block block;
        block.origin = glm::ivec3(i % side, i / side % side, i / side / side);
        blocks.push_back(block);
      }
      std::ranges::sort(blocks, {}, [](const Block& block) { return slowMorton(glm::uvec3(block.origin)); });
      std::map<std::tuple<int, int, int>, std::uint32_t> index;
      for (std::size_t i = 0; i < blocks.size(); ++i) {
        index[{blocks[i].origin.x, blocks[i].origin.y, blocks[i].origin.z}] = static_cast<std::uint32_t>(i);
      }
      linkNeighbours(blocks);
      for (const Block& block : blocks) {
        for (std::size_t face = 0; face < 6; ++face) {
          glm::ivec3 other = block.origin;
          other[static_cast<int>(face / 2)] += face % 2 == 0 ? -1 : 1;
          const auto found = index.find({other.x, other.y, other.z});
          ASSERT_EQ(block.neighbours[face], found == index.end() ? kNoBlock : found->second) << side << " " << percent;
        }
      }
    }
  }
}

TEST(Volume, LevelsHalveUntilOneBlockHoldsEverything) {
  EXPECT_EQ(levelDims({1, 7, 300}, 0), glm::ivec3(1, 7, 300));
  EXPECT_EQ(levelDims({1, 7, 300}, 1), glm::ivec3(1, 4, 150));
  EXPECT_EQ(levelDims({65536, 65535, 1}, 17), glm::ivec3(1, 1, 1));
  EXPECT_EQ(levelCount({48, 48, 48}, 48), 1);
  EXPECT_EQ(levelCount({49, 1, 1}, 48), 2);
  EXPECT_EQ(levelCount({97, 1, 1}, 48), 3);
  EXPECT_EQ(levelCount({65536, 1, 1}, 4), 15);
  for (int side : {1, 5, 48, 49, 96, 97, 1000, 65535, 65536}) {
    for (int block : {4, 16, 48, 96}) {
      const int count = levelCount({1, side, 1}, block);
      ASSERT_LE(count, kMaxLevels);
      EXPECT_LE(levelDims({1, side, 1}, count - 1).y, block);
      if (count > 1) {
        EXPECT_GT(levelDims({1, side, 1}, count - 2).y, block);
      }
    }
  }
}

TEST(Volume, WorldBoxHoldsTheTurnedVolume) {
  VolumeInfo info;
  info.dims = {10, 20, 30};
  // x goes along -y at 2 a voxel, y along x at 3, z along z at 0.5; the first corner lies at (1, 2, 3).
  info.world_from_index =
      glm::dmat4(glm::dvec4(0, -2, 0, 0), glm::dvec4(3, 0, 0, 0), glm::dvec4(0, 0, 0.5, 0), glm::dvec4(1, 2, 3, 1));
  const WorldBox box = worldBox(info);
  EXPECT_EQ(box.min, glm::dvec3(1, -18, 3));
  EXPECT_EQ(box.max, glm::dvec3(61, 2, 18));
  EXPECT_EQ(unitDistance(info), 0.5);
}

TEST(Volume, RangeMaskBinCountsCuts) {
  const std::array<float, 7> cuts = {32, 64, 96, 128, 160, 192, 224};
  EXPECT_EQ(rangeMaskBin(cuts, 0), 0);
  EXPECT_EQ(rangeMaskBin(cuts, 31), 0);
  EXPECT_EQ(rangeMaskBin(cuts, 32), 1);
  EXPECT_EQ(rangeMaskBin(cuts, 255), 7);
}

// One hot voxel of a thousand has no say, one of a hundred has.
TEST(Volume, HighDensityPassesOverAFewHotVoxels) {
  ChannelInfo channel;
  channel.density_min = 10;
  channel.density_max = 2570;
  channel.histogram_lo = 10;
  channel.histogram_hi = 2570;  // bins of 10
  channel.nonempty_voxels = 1000;
  channel.histogram[3] = 999;
  channel.histogram[255] = 1;
  EXPECT_EQ(highDensity(VoxelType::u16, channel), 50);
  channel.histogram[3] = 990;
  channel.histogram[255] = 10;
  EXPECT_EQ(highDensity(VoxelType::u16, channel), 2570);
  channel.histogram_hi = channel.density_max = 10;
  EXPECT_EQ(highDensity(VoxelType::u16, channel), 10);
  EXPECT_EQ(highDensity(VoxelType::u16, ChannelInfo{}), 0);
}

}  // namespace
}  // namespace blockwalk
