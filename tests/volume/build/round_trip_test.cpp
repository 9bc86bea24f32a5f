// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <limits>

#include "tests/volume/file/file_contents.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"
#include "volume/error.h"

namespace blockwalk::volume_test {
namespace {

// A record says exactly what its voxels say.
void expectRecordsMatch(const VolumeFile& file, int index) {
  const VolumeInfo& info = file.info();
  const Level level = file.readLevel(index, 0);
  std::vector<std::byte> voxels(static_cast<std::size_t>(level.info.voxel_bytes));
  file.readVoxels(index, 0, 0, level.info.subblock_count, voxels);
  const auto per = static_cast<std::size_t>(info.subblockVoxels());
  std::uint64_t last = 0;
  for (std::size_t b = 0; b < level.blocks.size(); ++b) {
    const Block& block = level.blocks[b];
    const std::uint64_t code = mortonCode(glm::uvec3(block.origin));
    ASSERT_TRUE(b == 0 || code > last);
    last = code;
    float block_min = std::numeric_limits<float>::infinity();
    float block_max = -block_min;
    unsigned block_mask = 0;
    int local = -1;
    for (std::size_t i = block.first_subblock; i < block.first_subblock + block.subblock_count; ++i) {
      do ++local;
      while ((block.occupancy[static_cast<std::size_t>(local / 64)] >> (local % 64) & 1) == 0);
      const int bs = info.block_side;
      const glm::ivec3 begin = block.origin * info.blockVoxels() +
                               info.subblock_side * glm::ivec3(local % bs, local / bs % bs, local / bs / bs);
      float min = std::numeric_limits<float>::infinity();
      float max = -min;
      unsigned mask = 0;
      for (std::size_t v = 0; v < per; ++v) {
        const int n = static_cast<int>(v);
        const int side = info.subblock_side;
        const glm::ivec3 p = begin + glm::ivec3(n % side, n / side % side, n / side / side);
        if (p.x >= level.info.dims.x || p.y >= level.info.dims.y || p.z >= level.info.dims.z) continue;
        const float density = storedDensity(info.type, voxels.data() + (i * per + v) * voxelBytes(info.type));
        if (isEmptyDensity(density, info.channels[0].empty_threshold)) continue;
        min = std::min(min, density);
        max = std::max(max, density);
        mask |= 1u << rangeMaskBin(info.channels[0].bin_cuts, density);
      }
      ASSERT_EQ(level.subblocks[i].density_min, min);
      ASSERT_EQ(level.subblocks[i].density_max, max);
      ASSERT_EQ(level.subblocks[i].range_mask, mask);
      block_min = std::min(block_min, min);
      block_max = std::max(block_max, max);
      block_mask |= mask;
    }
    ASSERT_EQ(block.density_min, block_min);
    ASSERT_EQ(block.density_max, block_max);
    ASSERT_EQ(block.range_mask, block_mask);
  }
}

void expectRoundTrip(MemorySource& source, const std::filesystem::path& path, const BuildOptions& options) {
  const BuildReport report = buildVolume(source, path, options);
  const VolumeFile file(path);
  const VolumeInfo& info = file.info();
  ASSERT_EQ(info.dims, source.info().dims);
  ASSERT_EQ(info.type, source.info().type);
  ASSERT_EQ(file.fileBytes(), report.file_bytes);
  ASSERT_EQ(report.file_bytes, report.level0_voxel_bytes + report.coarser_level_bytes + report.overhead_bytes);

  const DenseLevel dense = readDense(file, 0);
  ASSERT_TRUE(dense.padding_is_zero);
  const std::size_t bytes = voxelBytes(info.type);
  std::uint64_t nonempty = 0;
  std::uint64_t nonfinite = 0;
  float min = std::numeric_limits<float>::infinity();
  float max = -min;
  for (std::size_t i = 0; i < source.voxelCount(); ++i) {
    const std::byte* voxel = source.voxels.data() + i * bytes;
    const float density = storedDensity(info.type, voxel);
    if (!std::isfinite(density)) ++nonfinite;
    const bool empty = isEmptyDensity(density, info.channels[0].empty_threshold);
    if (dense.stored[i]) {
      ASSERT_EQ(std::memcmp(dense.voxels.data() + i * bytes, voxel, bytes), 0) << "voxel " << i;
    } else {
      ASSERT_TRUE(empty) << "voxel " << i;
    }
    if (empty) continue;
    ++nonempty;
    min = std::min(min, density);
    max = std::max(max, density);
  }
  ASSERT_EQ(info.channels[0].nonempty_voxels, nonempty);
  ASSERT_EQ(info.channels[0].nonfinite_voxels, nonfinite);
  if (nonempty > 0) {
    ASSERT_EQ(info.channels[0].density_min, min);
    ASSERT_EQ(info.channels[0].density_max, max);
  }
  for (std::size_t i = 0; i < info.levels.size(); ++i) expectRecordsMatch(file, static_cast<int>(i));
  ASSERT_EQ(verifyVolume(source, path), source.voxelCount());
}

class RoundTrip : public testing::TestWithParam<VoxelType> {};

TEST_P(RoundTrip, EveryVoxelComesBack) {
  const ScratchFolder folder;
  unsigned seed = 1;
  for (int subblock : {4, 8, 16}) {
    for (int block : {1, 2, 3, 5, 6}) {
      const int side = subblock * block;
      for (const glm::ivec3& dims : {glm::ivec3(1, 1, 1), glm::ivec3(1, 1, 300), glm::ivec3(side), glm::ivec3(side + 1),
                                     glm::ivec3(83, 57, 35)}) {
        ++seed;
        SCOPED_TRACE(testing::Message() << subblock << "/" << block << " " << dims.x << "x" << dims.y << "x" << dims.z);
        MemorySource source = randomSource(GetParam(), dims, seed, seed % 2 == 0);
        ASSERT_NO_FATAL_FAILURE(
            expectRoundTrip(source, folder / "volume.bwv", {.subblock_side = subblock, .block_side = block}));
      }
    }
  }
}

TEST_P(RoundTrip, QuantileAndUniformBinsHoldTheirVoxels) {
  const ScratchFolder folder;
  for (MaskBins bins : {MaskBins::uniform, MaskBins::quantile}) {
    MemorySource source = randomSource(GetParam(), {70, 60, 50}, 77);
    ASSERT_NO_FATAL_FAILURE(expectRoundTrip(source, folder / "volume.bwv", {.mask_bins = bins}));
    const VolumeInfo info = VolumeFile(folder / "volume.bwv").info();
    for (std::size_t i = 1; i < info.channels[0].bin_cuts.size(); ++i)
      EXPECT_LT(info.channels[0].bin_cuts[i - 1], info.channels[0].bin_cuts[i]);
  }
}

TEST_P(RoundTrip, VerifyFindsOneChangedVoxel) {
  const ScratchFolder folder;
  MemorySource source = randomSource(GetParam(), {60, 50, 40}, 5);
  buildVolume(source, folder / "volume.bwv", {});
  const glm::ivec3 places[] = {{0, 0, 0}, {59, 49, 39}, {31, 7, 22}};
  for (const glm::ivec3& place : places) {
    const std::uint32_t bits = source.info().type == VoxelType::f32 ? 0x42f60000 : 0xa5a5a5a5;
    std::uint32_t before = 0;
    std::memcpy(&before, source.at(place), voxelBytes(GetParam()));
    std::memcpy(source.at(place), &bits, voxelBytes(GetParam()));
    EXPECT_THROW(verifyVolume(source, folder / "volume.bwv"), DataError);
    std::memcpy(source.at(place), &before, voxelBytes(GetParam()));
  }
  EXPECT_EQ(verifyVolume(source, folder / "volume.bwv"), source.voxelCount());
}

INSTANTIATE_TEST_SUITE_P(Types, RoundTrip,
                         testing::Values(VoxelType::rgba8, VoxelType::u8, VoxelType::u16, VoxelType::f32),
                         [](const auto& type) { return std::string(voxelTypeName(type.param)); });

}  // namespace
}  // namespace blockwalk::volume_test
