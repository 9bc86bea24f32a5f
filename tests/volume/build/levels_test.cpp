// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "tests/volume/file/file_contents.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"

namespace blockwalk::volume_test {
namespace {

struct Color {
  std::uint8_t red, green, blue, density;
};

// Sum over a level's voxels, each weighted with the level-0 voxels that it covers.
double densitySum(const VolumeFile& file, int index) {
  const VolumeInfo& info = file.info();
  const DenseLevel dense = readDense(file, index);
  const glm::ivec3 dims = dense.level.info.dims;
  const int scale = 1 << index;
  double sum = 0;
  std::size_t at = 0;
  for (int z = 0; z < dims.z; ++z) {
    for (int y = 0; y < dims.y; ++y) {
      for (int x = 0; x < dims.x; ++x, at += voxelBytes(info.type)) {
        const glm::ivec3 covered = glm::min(info.dims - glm::ivec3(x, y, z) * scale, glm::ivec3(scale));
        sum +=
            static_cast<double>(storedDensity(info.type, dense.voxels.data() + at)) * covered.x * covered.y * covered.z;
      }
    }
  }
  return sum;
}

TEST(BuilderLevels, ConserveTheSumOfDensity) {
  const ScratchFolder folder;
  // Even dims: at odd ones the outermost coarse voxel averages fewer children, which halving again cannot weigh.
  for (int block_side : {1, 3, 6}) {
    MemorySource source = randomSource(VoxelType::f32, {128, 64, 64}, 11);
    for (std::byte& byte : source.voxels) byte = std::byte{0};
    for (int i = 0; i < 20000; ++i)
      source.set<float>({(i * 37) % 128, (i * 53) % 64, (i * 17) % 64}, 1.0f + static_cast<float>(i % 50));
    buildVolume(source, folder / "volume.bwv", {.subblock_side = 4, .block_side = block_side});
    const VolumeFile file(folder / "volume.bwv");
    const double sum = densitySum(file, 0);
    ASSERT_GT(sum, 1000);
    for (std::size_t i = 1; i < file.info().levels.size(); ++i) {
      EXPECT_NEAR(densitySum(file, static_cast<int>(i)) / sum, 1, 1e-5) << "level " << i;
    }
  }
}

// The next level as docs/format.md defines it, voxel by voxel from the level before; absent voxels are 0.
template <typename T>
void expectMeans(const VolumeFile& file, int index) {
  const DenseLevel fine = readDense(file, index - 1);
  const DenseLevel coarse = readDense(file, index);
  const glm::ivec3 dims = fine.level.info.dims;
  const glm::ivec3 half = coarse.level.info.dims;
  std::size_t at = 0;
  for (int z = 0; z < half.z; ++z) {
    for (int y = 0; y < half.y; ++y) {
      for (int x = 0; x < half.x; ++x, ++at) {
        double sum = 0;
        int count = 0;
        for (int child = 0; child < 8; ++child) {
          const glm::ivec3 p(2 * x + (child & 1), 2 * y + (child >> 1 & 1), 2 * z + (child >> 2));
          if (p.x >= dims.x || p.y >= dims.y || p.z >= dims.z) continue;
          T value{};
          const auto index0 =
              (static_cast<std::size_t>(p.z) * static_cast<std::size_t>(dims.y) + static_cast<std::size_t>(p.y)) *
                  static_cast<std::size_t>(dims.x) +
              static_cast<std::size_t>(p.x);
          std::memcpy(&value, fine.voxels.data() + index0 * sizeof(T), sizeof(T));
          sum += static_cast<double>(value);
          ++count;
        }
        const double mean = std::is_integral_v<T> ? std::floor(sum / count + 0.5) : sum / count;
        T found{};
        std::memcpy(&found, coarse.voxels.data() + at * sizeof(T), sizeof(T));
        if (coarse.stored[at]) {
          ASSERT_EQ(found, static_cast<T>(mean)) << "level " << index << " voxel " << x << "," << y << "," << z;
        } else {
          ASSERT_EQ(static_cast<T>(mean), T{0}) << "level " << index << " voxel " << x << "," << y << "," << z;
        }
      }
    }
  }
}

TEST(BuilderLevels, ScalarsAreMeansOfTheirChildrenInside) {
  const ScratchFolder folder;
  for (int subblock_side : {4, 8, 16}) {
    for (int block_side : {1, 3, 4}) {
      const BuildOptions options{.subblock_side = subblock_side, .block_side = block_side};
      MemorySource narrow = randomSource(VoxelType::u8, {97, 61, 43}, 3);
      buildVolume(narrow, folder / "u8.bwv", options);
      const VolumeFile u8(folder / "u8.bwv");
      for (std::size_t i = 1; i < u8.info().levels.size(); ++i) expectMeans<std::uint8_t>(u8, static_cast<int>(i));
      MemorySource wide = randomSource(VoxelType::u16, {97, 61, 43}, 4);
      buildVolume(wide, folder / "u16.bwv", options);
      const VolumeFile u16(folder / "u16.bwv");
      for (std::size_t i = 1; i < u16.info().levels.size(); ++i) expectMeans<std::uint16_t>(u16, static_cast<int>(i));
    }
  }
}

TEST(BuilderLevels, ColorIsWeightedByDensity) {
  const ScratchFolder folder;
  MemorySource source(VoxelType::rgba8, {10, 4, 4});
  source.set<Color>({0, 0, 0}, {200, 0, 100, 240});
  source.set<Color>({1, 0, 0}, {0, 100, 100, 80});
  source.set<Color>({1, 1, 1}, {255, 255, 255, 0});  // invisible: its colour must not show
  source.set<Color>({9, 3, 3}, {9, 8, 7, 255});      // the only one of its children beyond x = 8 and 9
  buildVolume(source, folder / "volume.bwv", {.subblock_side = 4, .block_side = 2});
  const VolumeFile file(folder / "volume.bwv");
  ASSERT_EQ(file.info().levels.size(), 2u);
  const DenseLevel coarse = readDense(file, 1);
  Color color{};
  std::memcpy(&color, coarse.voxels.data(), sizeof color);
  EXPECT_EQ(color.red, 150);  // 200 * 240 / 320
  EXPECT_EQ(color.green, 25);
  EXPECT_EQ(color.blue, 100);
  EXPECT_EQ(color.density, 40);  // 320 / 8
  std::memcpy(&color, coarse.voxels.data() + (4 + 5 * (1 + 2 * 1)) * 4, sizeof color);
  EXPECT_EQ(color.red, 9);
  EXPECT_EQ(color.green, 8);
  EXPECT_EQ(color.blue, 7);
  EXPECT_EQ(color.density, 32);  // 255 / 8 to the nearest
}

TEST(BuilderLevels, AbsentVoxelsCountAsEmptyInScalars) {
  const ScratchFolder folder;
  // With negative values the threshold is the least value, and that is what absent voxels are.
  MemorySource source(VoxelType::f32, {40, 8, 8});
  for (int i = 0; i < 40 * 8 * 8; ++i) source.set<float>({i % 40, i / 40 % 8, i / 320}, -1000.0f);
  source.set<float>({20, 4, 4}, 600.0f);
  source.set<float>({21, 4, 4}, std::numeric_limits<float>::quiet_NaN());
  buildVolume(source, folder / "volume.bwv", {.subblock_side = 4, .block_side = 3});
  const VolumeFile file(folder / "volume.bwv");
  EXPECT_EQ(file.info().channels[0].empty_threshold, -1000.0f);
  EXPECT_EQ(file.info().channels[0].density_min, 600.0f);
  ASSERT_GE(file.info().levels.size(), 2u);
  const DenseLevel coarse = readDense(file, 1);
  float value = 0;
  const std::size_t at = 10 + 20 * (2 + 4 * 2);
  ASSERT_TRUE(coarse.stored[at]);
  std::memcpy(&value, coarse.voxels.data() + at * sizeof value, sizeof value);
  EXPECT_FLOAT_EQ(value, (600.0f - 7000.0f) / 8);
  EXPECT_EQ(coarse.level.subblocks.size(), 1u);
}

}  // namespace
}  // namespace blockwalk::volume_test
