// SPDX-License-Identifier: Apache-2.0
// What is empty, what the range is, and what the builder refuses.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <system_error>

#include "tests/volume/file/file_contents.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"
#include "volume/error.h"

namespace blockwalk::volume_test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

MemorySource floats(glm::ivec3 dims, float value) {
  MemorySource source(VoxelType::f32, dims);
  for (int i = 0; i < dims.x * dims.y * dims.z; ++i) {
    source.set<float>({i % dims.x, i / dims.x % dims.y, i / dims.x / dims.y}, value);
  }
  return source;
}

VolumeInfo build(MemorySource& source, const BuildOptions& options = {}) {
  const ScratchFolder folder;
  buildVolume(source, folder / "volume.bwv", options);
  EXPECT_EQ(verifyVolume(source, folder / "volume.bwv"), source.voxelCount());
  readContents(folder / "volume.bwv");
  return VolumeFile(folder / "volume.bwv").info();
}

TEST(BuilderThreshold, ZeroIsEmptyUnlessSomethingIsNegative) {
  MemorySource source = floats({20, 20, 20}, 0.0f);
  source.set<float>({3, 4, 5}, 2.5f);
  source.set<float>({3, 4, 6}, -0.0f);
  VolumeInfo info = build(source);
  EXPECT_EQ(info.channels[0].empty_threshold, 0.0f);
  EXPECT_EQ(info.channels[0].density_min, 2.5f);
  EXPECT_EQ(info.channels[0].density_max, 2.5f);
  EXPECT_EQ(info.channels[0].nonempty_voxels, 1u);
  EXPECT_EQ(info.levels[0].subblock_count, 1u);

  source.set<float>({19, 0, 0}, -1.0f);
  info = build(source);
  EXPECT_EQ(info.channels[0].empty_threshold, -1.0f);
  EXPECT_EQ(info.channels[0].density_min, 0.0f);
  EXPECT_EQ(info.channels[0].density_max, 2.5f);
  EXPECT_EQ(info.channels[0].nonempty_voxels, 7999u);
}

TEST(BuilderThreshold, StoredOffsetsAreDataUnits) {
  // int16 as u16 with offset -32768: 0 data units are stored as 32768.
  MemorySource source(VoxelType::u16, {9, 9, 9});
  source.change().channels[0].value_offset = -32768;
  for (int i = 0; i < 729; ++i) source.set<std::uint16_t>({i % 9, i / 9 % 9, i / 81}, 32768);
  source.set<std::uint16_t>({8, 8, 8}, 32770);
  VolumeInfo info = build(source);
  EXPECT_EQ(info.channels[0].empty_threshold, 32768.0f);
  EXPECT_EQ(info.channels[0].density_min, 32770.0f);
  EXPECT_EQ(info.channels[0].nonempty_voxels, 1u);
  source.set<std::uint16_t>({0, 0, 0}, 31744);  // -1024
  info = build(source);
  EXPECT_EQ(info.channels[0].empty_threshold, 31744.0f);
  EXPECT_EQ(info.channels[0].nonempty_voxels, 728u);
  info = build(source, {.empty_thresholds = {1.5}});
  EXPECT_EQ(info.channels[0].empty_threshold, 32769.5f);
  EXPECT_EQ(info.channels[0].nonempty_voxels, 1u);
}

TEST(BuilderThreshold, AStatedThresholdBelowEverythingKeepsEverything) {
  MemorySource source = floats({13, 7, 5}, 0.0f);
  const VolumeInfo info = build(source, {.empty_thresholds = {-3}});
  EXPECT_EQ(info.channels[0].nonempty_voxels, 455u);
  EXPECT_EQ(info.channels[0].density_min, 0.0f);
  EXPECT_EQ(info.channels[0].density_max, 0.0f);
}

TEST(BuilderThreshold, DegenerateVolumesStillBuild) {
  for (const float value : {0.0f, -5.0f, 7.0f, kNan, kInfinity, -kInfinity, std::numeric_limits<float>::max(),
                            std::numeric_limits<float>::lowest(), std::numeric_limits<float>::denorm_min()}) {
    SCOPED_TRACE(value);
    MemorySource source = floats({50, 9, 10}, value);
    const VolumeInfo info = build(source);
    const bool empty = !(value > 0) || !std::isfinite(value);
    EXPECT_EQ(info.channels[0].nonempty_voxels, empty ? 0u : 4500u);
    EXPECT_EQ(info.channels[0].nonfinite_voxels, std::isfinite(value) ? 0u : 4500u);
    EXPECT_EQ(info.levels[0].block_count > 0, !empty);
    if (!empty) {
      EXPECT_EQ(info.channels[0].density_min, value);
      EXPECT_EQ(info.channels[0].density_max, value);
    }
  }
  for (VoxelType type : {VoxelType::rgba8, VoxelType::u8, VoxelType::u16}) {
    MemorySource source(type, {50, 9, 10});
    EXPECT_EQ(build(source).channels[0].nonempty_voxels, 0u);
    std::ranges::fill(source.voxels, std::byte{255});
    EXPECT_EQ(build(source).channels[0].nonempty_voxels, 4500u);
  }
}

TEST(BuilderThreshold, ExtremesOfFloatSurviveAveraging) {
  MemorySource source = floats({50, 50, 50}, std::numeric_limits<float>::max());
  source.set<float>({1, 1, 1}, std::numeric_limits<float>::lowest());
  const VolumeInfo info = build(source);
  EXPECT_EQ(info.channels[0].density_max, std::numeric_limits<float>::max());
}

TEST(BuilderThreshold, QuantileBinsHoldEqualShares) {
  MemorySource source(VoxelType::u16, {64, 64, 64});
  std::mt19937 random(9);
  for (int i = 0; i < 64 * 64 * 64; ++i) {
    const auto narrow = static_cast<std::uint16_t>(1000 + random() % 200 + (random() % 50 == 0 ? 40000 : 0));
    source.set<std::uint16_t>({i % 64, i / 64 % 64, i / 4096}, narrow);
  }
  const VolumeInfo info = build(source);
  std::array<int, 8> shares{};
  for (std::size_t i = 0; i < source.voxelCount(); ++i) {
    ++shares[static_cast<std::size_t>(
        rangeMaskBin(info.channels[0].bin_cuts, storedDensity(VoxelType::u16, source.voxels.data() + 2 * i)))];
  }
  for (int share : shares) EXPECT_NEAR(share, 32768, 1500);
}

TEST(BuilderThreshold, EightBitsHaveTheCutsOfThePaper) {
  MemorySource source = randomSource(VoxelType::u8, {30, 30, 30}, 1);
  const VolumeInfo info = build(source);
  const std::array<float, 7> cuts = {32, 64, 96, 128, 160, 192, 224};
  EXPECT_EQ(info.channels[0].bin_cuts, cuts);
  EXPECT_EQ(info.channels[0].histogram_lo, 0.0f);
  EXPECT_EQ(info.channels[0].histogram_hi, 255.0f);
  std::array<std::uint64_t, 256> expected{};
  for (std::byte voxel : source.voxels) ++expected[std::to_integer<std::size_t>(voxel)];
  expected[0] = 0;
  EXPECT_EQ(info.channels[0].histogram, expected);
}

TEST(BuilderRefuses, WhatIsOutOfBounds) {
  const ScratchFolder folder;
  MemorySource source = randomSource(VoxelType::u8, {5, 5, 5}, 1);
  const auto refuses = [&](const BuildOptions& options) {
    EXPECT_THROW(buildVolume(source, folder / "volume.bwv", options), DataError);
    EXPECT_TRUE(std::filesystem::is_empty(folder.path));
  };
  for (int side : {-8, 0, 1, 5, 6, 32}) refuses({.subblock_side = side});
  for (int side : {-1, 0, 7, 1000000}) refuses({.block_side = side});
  refuses({.memory_bytes = (std::uint64_t{64} << 20) - 1});
  refuses({.empty_thresholds = {std::nan("")}});
  refuses({.empty_thresholds = {1e300}});
  for (const glm::ivec3& dims : {glm::ivec3(0, 5, 5), glm::ivec3(5, -1, 5), glm::ivec3(5, 5, 65537)}) {
    source.change().dims = dims;
    refuses({});
  }
  source.change().dims = glm::ivec3(5);
  for (const double scale : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    source.change().channels[0].value_scale = scale;
    refuses({});
  }
  source.change().channels[0].value_scale = 1;
  source.change().world_from_index = glm::dmat4(0.0);
  refuses({});
  source.change().world_from_index = glm::dmat4(std::nan(""));
  refuses({});
  source.change().world_from_index = glm::dmat4(1.0);
  EXPECT_THROW(buildVolume(source, folder / "none/volume.bwv", {}), std::system_error);
  EXPECT_THROW(buildVolume(source, folder.path, {}), std::system_error);
  EXPECT_NO_THROW(buildVolume(source, folder / "volume.bwv", {}));
}

TEST(BuilderRefuses, AFailingSourceAndLeavesTheOldFile) {
  struct Failing : MemorySource {
    using MemorySource::MemorySource;
    void readRows(int z, int y, int count, std::span<std::byte> out) override {
      if (z == 20) failData("slice 20 is broken");
      MemorySource::readRows(z, y, count, out);
    }
  };
  const ScratchFolder folder;
  writeBytes(folder / "volume.bwv", "old");
  Failing source(VoxelType::u8, {30, 30, 30});
  EXPECT_THROW(buildVolume(source, folder / "volume.bwv", {}), DataError);
  EXPECT_EQ(readBytes(folder / "volume.bwv"), "old");
  std::size_t names = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path)) ++names;
  EXPECT_EQ(names, 1u);
}

TEST(BuilderRefuses, OddNamesBecomePlainText) {
  MemorySource source = randomSource(VoxelType::u8, {5, 5, 5}, 1);
  source.change().name = "a\x1b[31m\xff\xc3\xa9\xed\xa0\x80.raw";
  EXPECT_EQ(build(source).metadata.source_name, "a?[31m?\xc3\xa9???.raw");
}

}  // namespace
}  // namespace blockwalk::volume_test
