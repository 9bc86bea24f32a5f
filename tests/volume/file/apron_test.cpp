// SPDX-License-Identifier: Apache-2.0
#include "volume/file/apron.h"

#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "tests/volume/file/file_contents.h"
#include "tests/volume/memory_source.h"
#include "volume/build/budget.h"
#include "volume/build/builder.h"

namespace blockwalk::volume_test {
namespace {

struct ApronCase {
  VoxelType type = VoxelType::u8;
  glm::ivec3 dims{0};
  int subblock_side = 8;
  int block_side = 6;
  double threshold = 0;
  std::size_t channels = 1;
};

class Apron : public testing::TestWithParam<ApronCase> {};

using Voxel = std::array<std::byte, 4>;

// What interpolation reads at any place, from the source alone.
Voxel fieldVoxel(MemorySource& source, const VolumeInfo& info, glm::ivec3 at, std::size_t channel) {
  const std::byte* voxel = source.at(glm::clamp(at, glm::ivec3(0), info.dims - 1), channel);
  Voxel result{};
  if (!isEmptyDensity(storedDensity(info.type, voxel), info.channels[channel].empty_threshold)) {
    std::memcpy(result.data(), voxel, voxelBytes(info.type));
    return result;
  }
  const float empty = emptyValue(info.type, info.channels[channel]);
  const auto narrow = static_cast<std::uint16_t>(info.type == VoxelType::f32 ? 0 : empty);
  if (info.type == VoxelType::f32) std::memcpy(result.data(), &empty, sizeof empty);
  if (info.type != VoxelType::f32) std::memcpy(result.data(), &narrow, sizeof narrow);
  return result;
}

bool isEmpty(MemorySource& source, const VolumeInfo& info, glm::ivec3 at, std::size_t channel) {
  const std::byte* voxel = source.at(glm::clamp(at, glm::ivec3(0), info.dims - 1), channel);
  return isEmptyDensity(storedDensity(info.type, voxel), info.channels[channel].empty_threshold);
}

bool isEmptyInAll(MemorySource& source, const VolumeInfo& info, glm::ivec3 at) {
  bool empty = true;
  for (std::size_t channel = 0; channel < info.channels.size(); ++channel) {
    empty = empty && isEmpty(source, info, at, channel);
  }
  return empty;
}

struct Visible {
  bool any = false;
  float least = std::numeric_limits<float>::infinity();
  float largest = -std::numeric_limits<float>::infinity();
};

// Compares a subblock's voxels with the source; returns what its apron holds.
Visible checkVoxels(MemorySource& source, const VolumeInfo& info, glm::ivec3 first, std::size_t channel,
                    const std::byte* voxels) {
  Visible visible;
  const int side = info.subblock_side;
  for (int z = -1; z <= side; ++z) {
    for (int y = -1; y <= side; ++y) {
      for (int x = -1; x <= side; ++x, voxels += voxelBytes(info.type)) {
        const glm::ivec3 at = first + glm::ivec3(x, y, z);
        const Voxel expected = fieldVoxel(source, info, at, channel);
        EXPECT_EQ(std::memcmp(voxels, expected.data(), voxelBytes(info.type)), 0) << at.x << ' ' << at.y << ' ' << at.z;
        const float density = storedDensity(info.type, expected.data());
        visible.least = std::min(visible.least, density);
        visible.largest = std::max(visible.largest, density);
        visible.any = visible.any || !isEmpty(source, info, at, channel);
      }
    }
  }
  return visible;
}

std::tuple<int, int, int> key(glm::ivec3 p) { return {p.x, p.y, p.z}; }

using Subblocks = std::set<std::tuple<int, int, int>>;

// Reads every block of one channel and holds it against the source; returns the subblocks that are there.
Subblocks checkBlocks(MemorySource& source, const VolumeInfo& info, ApronLevel& apron, std::size_t channel) {
  const int side = info.subblock_side;
  const auto& cuts = info.channels[channel].bin_cuts;
  Subblocks present;
  for (std::size_t b = 0; b < apron.records().blocks.size(); ++b) {
    const Block& block = apron.records().blocks[b];
    std::vector<std::byte> voxels(block.subblock_count * apron.subblockBytes());
    apron.readBlock(b, voxels);
    std::size_t rank = 0;
    for (int local = 0; local < info.block_side * info.block_side * info.block_side; ++local) {
      if ((block.occupancy[static_cast<std::size_t>(local) / 64] >> (local % 64) & 1u) == 0) continue;
      const glm::ivec3 at(local % info.block_side, local / info.block_side % info.block_side,
                          local / (info.block_side * info.block_side));
      const glm::ivec3 first = (block.origin * info.block_side + at) * side;
      const Visible visible = checkVoxels(source, info, first, channel, voxels.data() + rank * apron.subblockBytes());
      const Subblock& record = apron.records().subblocks[block.first_subblock + rank];
      EXPECT_EQ(record.density_min, visible.least);
      EXPECT_EQ(record.density_max, visible.largest);
      EXPECT_LE(block.density_min, record.density_min);
      EXPECT_GE(block.density_max, record.density_max);
      EXPECT_EQ(record.range_mask != 0, visible.any);
      for (int bin = rangeMaskBin(cuts, visible.least); visible.any && bin <= rangeMaskBin(cuts, visible.largest);
           ++bin) {
        EXPECT_TRUE(record.range_mask >> bin & 1);
      }
      EXPECT_EQ(block.range_mask & record.range_mask, record.range_mask);
      EXPECT_TRUE(visible.any || info.channels.size() > 1);
      present.insert(key(first / side));
      ++rank;
    }
    EXPECT_EQ(rank, block.subblock_count);
  }
  return present;
}

TEST_P(Apron, HoldsTheRingOfEverySubblockThatInterpolationCanSee) {
  const ApronCase& c = GetParam();
  const ScratchFolder folder;
  MemorySource source = randomSource(c.type, c.dims, 7, false, c.channels);
  buildVolume(source, folder / "a.bwv",
              {.subblock_side = c.subblock_side, .block_side = c.block_side, .empty_thresholds = {c.threshold}});
  const VolumeFile file(folder / "a.bwv");
  const VolumeInfo& info = file.info();
  const int side = info.subblock_side;
  ApronLevel apron(file, 0, 0);
  const Subblocks present = checkBlocks(source, info, apron, 0);
  for (std::size_t channel = 1; channel < c.channels; ++channel) {
    ApronLevel found(file, 0, static_cast<int>(channel));
    EXPECT_EQ(checkBlocks(source, info, found, channel), present);
    ApronLevel shared(apron, static_cast<int>(channel));
    EXPECT_EQ(checkBlocks(source, info, shared, channel), present);
  }
  for (int z = 0; z * side < c.dims.z; ++z) {
    for (int y = 0; y * side < c.dims.y; ++y) {
      for (int x = 0; x * side < c.dims.x; ++x) {
        bool any = false;
        for (int i = 0; i < (side + 2) * (side + 2) * (side + 2) && !any; ++i) {
          const glm::ivec3 place(i % (side + 2) - 1, i / (side + 2) % (side + 2) - 1,
                                 i / ((side + 2) * (side + 2)) - 1);
          any = !isEmptyInAll(source, info, glm::ivec3(x, y, z) * side + place);
        }
        EXPECT_EQ(present.contains({x, y, z}), any) << x << ' ' << y << ' ' << z;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Of, Apron,
    testing::Values(ApronCase{.type = VoxelType::u8, .dims = {57, 41, 33}, .block_side = 2},
                    ApronCase{.type = VoxelType::u8, .dims = {8, 8, 8}},
                    ApronCase{.type = VoxelType::u8, .dims = {1, 1, 1}},
                    ApronCase{.type = VoxelType::u16, .dims = {48, 49, 47}, .threshold = 30000},
                    ApronCase{.type = VoxelType::rgba8, .dims = {40, 30, 50}, .subblock_side = 4, .block_side = 3},
                    ApronCase{.type = VoxelType::f32, .dims = {60, 20, 35}, .subblock_side = 16, .block_side = 1},
                    ApronCase{.type = VoxelType::f32, .dims = {1, 1, 200}, .block_side = 2},
                    ApronCase{.type = VoxelType::u8, .dims = {57, 41, 33}, .block_side = 2, .channels = 3},
                    ApronCase{.type = VoxelType::f32, .dims = {40, 30, 35}, .subblock_side = 4, .channels = 2}));

// What the file says of aprons, against all voxels of a level.
void checkLevel(const VolumeFile& file, int number, int channel_number, Form form) {
  const VolumeInfo& info = file.info();
  const ChannelInfo& values = info.channels[static_cast<std::size_t>(channel_number)];
  const float empty_value = emptyValue(info.type, values);
  std::vector<DenseLevel> channels;
  for (int i = 0; i < static_cast<int>(info.channels.size()); ++i) channels.push_back(readDense(file, number, i, form));
  const glm::ivec3 dims = channels[0].level.info.dims;
  const auto density = [&](int channel, glm::ivec3 p) {
    p = glm::clamp(p, glm::ivec3(0), dims - 1);
    const auto at = static_cast<std::size_t>(p.x + dims.x * (p.y + dims.y * p.z));
    const DenseLevel& dense = channels[static_cast<std::size_t>(channel)];
    const float own = storedDensity(info.type, dense.voxels.data() + at * voxelBytes(info.type));
    const float threshold = info.channels[static_cast<std::size_t>(channel)].empty_threshold;
    return !dense.stored[at] || isEmptyDensity(own, threshold) ? std::optional<float>() : own;
  };
  std::map<std::tuple<int, int, int>, Subblock> found;
  const Level level = file.readApronLevel(number, channel_number, form);
  for (const Block& block : level.blocks) {
    std::uint64_t next = block.first_subblock;
    for (int local = 0; local < info.block_side * info.block_side * info.block_side; ++local) {
      if ((block.occupancy[static_cast<std::size_t>(local) / 64] >> (local % 64) & 1u) == 0) continue;
      const glm::ivec3 at = block.origin * info.block_side + glm::ivec3(local % info.block_side,
                                                                        local / info.block_side % info.block_side,
                                                                        local / (info.block_side * info.block_side));
      found[{at.x, at.y, at.z}] = level.subblocks[next++];
    }
  }
  const int side = info.subblock_side;
  std::size_t expected = 0;
  for (int z = 0; z * side < dims.z; ++z) {
    for (int y = 0; y * side < dims.y; ++y) {
      for (int x = 0; x * side < dims.x; ++x) {
        bool any = false;
        float least = std::numeric_limits<float>::infinity();
        float greatest = -least;
        for (int i = 0; i < (side + 2) * (side + 2) * (side + 2); ++i) {
          const glm::ivec3 p =
              glm::ivec3(x, y, z) * side +
              glm::ivec3(i % (side + 2) - 1, i / (side + 2) % (side + 2) - 1, i / ((side + 2) * (side + 2)) - 1);
          for (int c = 0; c < static_cast<int>(channels.size()); ++c) any = any || density(c, p).has_value();
          least = std::min(least, density(channel_number, p).value_or(empty_value));
          greatest = std::max(greatest, density(channel_number, p).value_or(empty_value));
        }
        const auto record = found.find({x, y, z});
        ASSERT_EQ(record != found.end(), any) << number << ": " << x << ' ' << y << ' ' << z;
        if (!any) continue;
        ++expected;
        EXPECT_EQ(record->second.density_min, least) << number << ": " << x << ' ' << y << ' ' << z;
        EXPECT_EQ(record->second.density_max, greatest) << number << ": " << x << ' ' << y << ' ' << z;
      }
    }
  }
  EXPECT_EQ(found.size(), expected);
}

TEST_P(Apron, IsWhatAllVoxelsOfEveryLevelSay) {
  const ApronCase& c = GetParam();
  const ScratchFolder folder;
  MemorySource source = randomSource(c.type, c.dims, 11, c.type == VoxelType::f32, c.channels);
  // A cache of no size: the 27 blocks in use are all that stay.
  buildVolume(source, folder / "a.bwv",
              {.subblock_side = c.subblock_side, .block_side = c.block_side, .empty_thresholds = {c.threshold}},
              {.slab_bytes = 4000, .sort_bytes = 400, .stream_bytes = 600, .shell_bytes = 0});
  const VolumeFile file(folder / "a.bwv");
  for (int level = 0; level < static_cast<int>(file.info().levels.size()); ++level) {
    for (int channel = 0; channel < static_cast<int>(c.channels); ++channel) {
      checkLevel(file, level, channel, Form::values);
      if (file.info().has(level, Form::maxima)) checkLevel(file, level, channel, Form::maxima);
    }
  }
}

TEST(ApronLevel, KnowsItsSubblocksWithoutReadingVoxels) {
  const ScratchFolder folder;
  MemorySource source(VoxelType::u8, {200, 200, 200});
  std::ranges::fill(source.voxels, std::byte{9});
  buildVolume(source, folder / "a.bwv", {});
  const VolumeFile file(folder / "a.bwv");
  const std::uint64_t before = file.bytesRead();
  ApronLevel apron(file, 0, 0);
  EXPECT_EQ(apron.records().info.subblock_count, 25u * 25 * 25);
  EXPECT_LT(file.bytesRead() - before, file.info().levels[0].voxel_bytes / 50);
  // And reading all of it reads each stored block once, while they fit the cache.
  const std::uint64_t records = file.bytesRead();
  std::vector<std::byte> voxels;
  for (std::size_t i = 0; i < apron.records().blocks.size(); ++i) {
    voxels.resize(apron.records().blocks[i].subblock_count * apron.subblockBytes());
    apron.readBlock(i, voxels);
  }
  EXPECT_EQ(file.bytesRead() - records, file.info().levels[0].voxel_bytes);
}

TEST(ApronLevel, OfNothingIsEmpty) {
  const ScratchFolder folder;
  MemorySource source(VoxelType::u8, {20, 20, 20});
  buildVolume(source, folder / "a.bwv", {});
  const VolumeFile file(folder / "a.bwv");
  const ApronLevel apron(file, 0, 0);
  EXPECT_TRUE(apron.records().blocks.empty());
  EXPECT_EQ(apron.records().info.subblock_count, 0u);
}

}  // namespace
}  // namespace blockwalk::volume_test
