// SPDX-License-Identifier: Apache-2.0
// The levels that a maximum along rays is drawn from.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <optional>

#include "tests/volume/file/file_contents.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"

namespace blockwalk::volume_test {
namespace {

// The voxel of the greatest density among level 0's that a voxel of the level covers; nothing where all are empty.
std::optional<std::uint32_t> greatestOf(MemorySource& source, const VolumeInfo& info, int level, glm::ivec3 at,
                                        std::size_t channel) {
  const std::size_t bytes = voxelBytes(info.type);
  const int scale = 1 << level;
  std::optional<std::uint32_t> most;
  float density = 0;
  const glm::ivec3 end = glm::min((at + 1) * scale, info.dims);
  for (int z = at.z * scale; z < end.z; ++z) {
    for (int y = at.y * scale; y < end.y; ++y) {
      for (int x = at.x * scale; x < end.x; ++x) {
        const float own = storedDensity(info.type, source.at({x, y, z}, channel));
        if (isEmptyDensity(own, info.channels[channel].empty_threshold) || (most && own <= density)) continue;
        density = own;
        most = 0;
        std::memcpy(&*most, source.at({x, y, z}, channel), bytes);
      }
    }
  }
  return most;
}

void expectMaxima(MemorySource& source, const BuildOptions& options) {
  const ScratchFolder folder;
  buildVolume(source, folder / "a.bwv", options);
  const VolumeFile file(folder / "a.bwv");
  const VolumeInfo& info = file.info();
  ASSERT_EQ(info.maxima.size(), info.levels.size() - 2);
  ASSERT_GE(info.maxima.size(), 2u);
  for (int level = 2; level < static_cast<int>(info.levels.size()); ++level) {
    for (std::size_t channel = 0; channel < info.channels.size(); ++channel) {
      const DenseLevel dense = readDense(file, level, static_cast<int>(channel), Form::maxima);
      EXPECT_TRUE(dense.padding_is_zero);
      const glm::ivec3 dims = dense.level.info.dims;
      ASSERT_EQ(dims, levelDims(info.dims, level));
      for (int i = 0; i < dims.x * dims.y * dims.z; ++i) {
        const glm::ivec3 p(i % dims.x, i / dims.x % dims.y, i / dims.x / dims.y);
        const std::optional<std::uint32_t> expected = greatestOf(source, info, level, p, channel);
        const std::byte* voxel = dense.voxels.data() + static_cast<std::size_t>(i) * voxelBytes(info.type);
        const bool empty = !dense.stored[static_cast<std::size_t>(i)] ||
                           isEmptyDensity(storedDensity(info.type, voxel), info.channels[channel].empty_threshold);
        ASSERT_EQ(!empty, expected.has_value()) << level << ": " << p.x << ' ' << p.y << ' ' << p.z;
        if (info.type == VoxelType::rgba8 && expected) {
          ASSERT_EQ(std::to_integer<std::uint32_t>(voxel[3]), *expected >> 24);  // of equals any has its colour
        } else if (expected) {
          ASSERT_EQ(std::memcmp(voxel, &*expected, voxelBytes(info.type)), 0) << level << ": " << p.x << ' ' << p.y;
        }
      }
    }
  }
}

TEST(BuilderMaxima, AreTheGreatestOfLevel0) {
  for (const VoxelType type : {VoxelType::u8, VoxelType::u16, VoxelType::f32, VoxelType::rgba8}) {
    MemorySource source = randomSource(type, {61, 43, 37}, 21, type == VoxelType::f32);
    expectMaxima(source, {.subblock_side = 4, .block_side = 1});
  }
  MemorySource several = randomSource(VoxelType::u8, {61, 43, 37}, 22, false, 3);
  expectMaxima(several, {.subblock_side = 4, .block_side = 2, .empty_thresholds = {40}});
  MemorySource large = randomSource(VoxelType::u16, {150, 70, 65}, 23);
  expectMaxima(large, {.subblock_side = 8, .block_side = 1, .empty_thresholds = {20000}});
}

TEST(BuilderMaxima, ALoneVoxelReachesEveryLevel) {
  const ScratchFolder folder;
  MemorySource source(VoxelType::u8, {256, 256, 256});
  source.set<std::uint8_t>({101, 33, 202}, 200);
  buildVolume(source, folder / "a.bwv", {});
  const VolumeFile file(folder / "a.bwv");
  // As a mean it is gone from level 3 on.
  EXPECT_EQ(file.info().level(3, Form::values).block_count, 0u);
  for (int level = 2; level < static_cast<int>(file.info().levels.size()); ++level) {
    const Level maxima = file.readLevel(level, 0, Form::maxima);
    ASSERT_EQ(maxima.blocks.size(), 1u) << level;
    EXPECT_EQ(maxima.blocks[0].density_max, 200) << level;
  }
}

TEST(BuilderMaxima, OfLabelsOrSmallVolumesThereAreNone) {
  const ScratchFolder folder;
  MemorySource source = randomSource(VoxelType::u8, {90, 50, 50}, 8);
  EXPECT_TRUE(buildVolume(source, folder / "a.bwv", {.subblock_side = 4, .block_side = 1, .values = ValuesRule::labels})
                  .info.maxima.empty());
  EXPECT_TRUE(buildVolume(source, folder / "a.bwv", {}).info.maxima.empty());  // three levels would be needed
  EXPECT_NO_THROW(readContents(folder / "a.bwv"));
}

}  // namespace
}  // namespace blockwalk::volume_test
