// SPDX-License-Identifier: Apache-2.0
// Volumes of several channels: what is written, read back and averaged, channel by channel.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/volume/file/file_contents.h"
#include "tests/volume/memory_source.h"
#include "volume/build/budget.h"
#include "volume/build/builder.h"
#include "volume/error.h"

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;

struct ChannelsCase {
  VoxelType type = VoxelType::u8;
  std::size_t channels = 2;
  bool random_access = true;
  bool negative = false;
  bool tiny_memory = false;
};

void PrintTo(const ChannelsCase& c, std::ostream* out) { *out << voxelTypeName(c.type) << " x " << c.channels; }

class Channels : public testing::TestWithParam<ChannelsCase> {
 protected:
  void build(const glm::ivec3& dims = {61, 37, 29}) {
    const ChannelsCase& c = GetParam();
    source_ = randomSource(c.type, dims, 71, c.negative, c.channels);
    source_.change().random_access = c.random_access;
    const BuildOptions options{.subblock_side = 4, .block_side = 3};
    // Parts so small that slab, sort and streams all go through the disk.
    const BuildBudget tiny{.workers = 2, .slab_bytes = 3000, .sort_bytes = 400, .stream_bytes = 600};
    report_ = buildVolume(source_, folder_ / "a.bwv", options, c.tiny_memory ? tiny : budgetOf(options.memory_bytes));
  }

  ScratchFolder folder_;
  MemorySource source_{VoxelType::u8, {1, 1, 1}};
  BuildReport report_;
};

bool sameShape(const Level& a, const Level& b) {
  return a.subblocks.size() == b.subblocks.size() &&
         std::ranges::equal(a.blocks, b.blocks, [](const auto& x, const auto& y) {
           return x.origin == y.origin && x.occupancy == y.occupancy && x.subblock_count == y.subblock_count &&
                  x.first_subblock == y.first_subblock && x.neighbours == y.neighbours;
         });
}

TEST_P(Channels, EveryVoxelComesBack) {
  build();
  const VolumeFile file(folder_ / "a.bwv");
  const VolumeInfo& info = file.info();
  const std::size_t bytes = voxelBytes(info.type);
  ASSERT_EQ(info.channels.size(), GetParam().channels);
  std::size_t absent = 0;
  for (std::size_t c = 0; c < info.channels.size(); ++c) {
    const DenseLevel dense = readDense(file, 0, static_cast<int>(c));
    EXPECT_TRUE(dense.padding_is_zero);
    const ChannelInfo& channel = info.channels[c];
    std::uint64_t nonempty = 0;
    float least = std::numeric_limits<float>::max();
    float greatest = -least;
    for (std::size_t i = 0; i < dense.stored.size(); ++i) {
      const std::byte* wanted = source_.voxels.data() + (c * dense.stored.size() + i) * bytes;
      const float density = storedDensity(info.type, wanted);
      const bool empty = isEmptyDensity(density, channel.empty_threshold);
      if (!empty) {
        ++nonempty;
        least = std::min(least, density);
        greatest = std::max(greatest, density);
      }
      absent += dense.stored[i] ? 0 : 1;
      const bool same = std::memcmp(dense.voxels.data() + i * bytes, wanted, bytes) == 0;
      ASSERT_TRUE(dense.stored[i] ? same : empty) << "channel " << c << " voxel " << i;
    }
    EXPECT_EQ(channel.nonempty_voxels, nonempty);
    EXPECT_EQ(channel.density_min, least);
    EXPECT_EQ(channel.density_max, greatest);
  }
  EXPECT_EQ(absent > 0, !GetParam().negative);  // below 0 the empty value is the least one
  EXPECT_EQ(verifyVolume(source_, folder_ / "a.bwv"), std::uint64_t{61} * 37 * 29);
}

TEST_P(Channels, RangesAreTrueAndShapesEqualOnEveryLevel) {
  build();
  const VolumeFile file(folder_ / "a.bwv");
  const VolumeInfo& info = file.info();
  ASSERT_GT(info.levels.size(), 2u);
  int empty_records = 0;
  for (int n = 0; n < static_cast<int>(info.levels.size()); ++n) {
    const Level first = file.readLevel(n, 0);
    std::vector<int> masks(first.subblocks.size());
    for (std::size_t c = 0; c < info.channels.size(); ++c) {
      const Level level = file.readLevel(n, static_cast<int>(c));
      EXPECT_TRUE(sameShape(level, first));
      std::vector<std::byte> voxels(level.info.voxel_bytes);
      file.readVoxels(n, static_cast<int>(c), 0, level.info.subblock_count, voxels);
      const std::size_t bytes = voxelBytes(info.type);
      const std::size_t each = info.subblockVoxels();
      for (std::size_t i = 0; i < level.subblocks.size(); ++i) {
        Subblock expected;
        for (std::size_t v = 0; v < each; ++v) {
          const float density = storedDensity(info.type, voxels.data() + (i * each + v) * bytes);
          // Padding is 0: with a negative threshold it would count, so only its effect upwards is left out.
          if (isEmptyDensity(density, info.channels[c].empty_threshold)) continue;
          if (info.channels[c].empty_threshold < 0 && density == 0) continue;
          const bool any = expected.range_mask != 0;
          expected.density_min = any ? std::min(expected.density_min, density) : density;
          expected.density_max = any ? std::max(expected.density_max, density) : density;
          expected.range_mask |= static_cast<std::uint8_t>(1 << rangeMaskBin(info.channels[c].bin_cuts, density));
        }
        masks[i] |= level.subblocks[i].range_mask;
        if (info.channels[c].empty_threshold < 0) {
          ASSERT_EQ(level.subblocks[i].range_mask & expected.range_mask, expected.range_mask);
          continue;
        }
        ASSERT_EQ(level.subblocks[i].density_min, expected.density_min);
        ASSERT_EQ(level.subblocks[i].density_max, expected.density_max);
        ASSERT_EQ(level.subblocks[i].range_mask, expected.range_mask);
        empty_records += expected.range_mask == 0 ? 1 : 0;
      }
    }
    EXPECT_TRUE(std::ranges::none_of(masks, [](int mask) { return mask == 0; }));
  }
  if (!GetParam().negative) {
    EXPECT_GT(empty_records, 0);
  }
}

// What a channel is does not depend on the channels beside it.
TEST_P(Channels, EachIsWhatItIsAlone) {
  build();
  if (GetParam().negative) return;  // then what is stored and empty counts in averages with its own value
  const VolumeFile file(folder_ / "a.bwv");
  const std::size_t plane = source_.voxels.size() / GetParam().channels;
  for (std::size_t c = 0; c < GetParam().channels; ++c) {
    MemorySource alone(GetParam().type, source_.info().dims);
    std::copy_n(source_.voxels.begin() + static_cast<std::ptrdiff_t>(c * plane), plane, alone.voxels.begin());
    buildVolume(alone, folder_ / "alone.bwv", {.subblock_side = 4, .block_side = 3});
    const VolumeFile single(folder_ / "alone.bwv");
    const ChannelInfo& a = file.info().channels[c];
    const ChannelInfo& b = single.info().channels[0];
    EXPECT_EQ(a.empty_threshold, b.empty_threshold);
    EXPECT_EQ(a.bin_cuts, b.bin_cuts);
    EXPECT_EQ(a.histogram, b.histogram);
    EXPECT_EQ(a.nonfinite_voxels, b.nonfinite_voxels);
    ASSERT_EQ(file.info().levels.size(), single.info().levels.size());
    for (int n = 1; n < static_cast<int>(file.info().levels.size()); ++n) {
      EXPECT_EQ(readDense(file, n, static_cast<int>(c)).voxels, readDense(single, n).voxels) << n;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Of, Channels,
    testing::Values(ChannelsCase{.type = VoxelType::u8, .channels = 2},
                    ChannelsCase{.type = VoxelType::u8, .channels = 4, .random_access = false},
                    ChannelsCase{.type = VoxelType::u16, .channels = 3, .tiny_memory = true},
                    ChannelsCase{.type = VoxelType::u16, .random_access = false, .tiny_memory = true},
                    ChannelsCase{.type = VoxelType::f32, .channels = 4},
                    ChannelsCase{.type = VoxelType::f32, .random_access = false, .tiny_memory = true},
                    ChannelsCase{.type = VoxelType::f32, .channels = 3, .negative = true, .tiny_memory = true}));

TEST(ChannelsBuild, VerifyFindsAVoxelThatChangedInChannelOne) {
  const ScratchFolder folder;
  MemorySource source = randomSource(VoxelType::u16, {40, 30, 20}, 9, false, 3);
  buildVolume(source, folder / "a.bwv", {});
  ASSERT_NO_THROW(verifyVolume(source, folder / "a.bwv"));
  const auto message = [&] {
    try {
      verifyVolume(source, folder / "a.bwv");
    } catch (const DataError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  *source.at({13, 7, 5}, 1) ^= std::byte{1};
  EXPECT_THAT(message(), HasSubstr("voxel 13,7,5 of channel 1"));
  *source.at({13, 7, 5}, 1) ^= std::byte{1};
  ASSERT_EQ(message(), "no error");
  source = randomSource(VoxelType::u16, {40, 30, 20}, 9, false, 2);
  EXPECT_THAT(message(), HasSubstr("3 channels, but memory has 2"));
}

TEST(ChannelsBuild, EachHasItsThresholdAndItsValueMap) {
  const ScratchFolder folder;
  MemorySource source(VoxelType::u8, {20, 20, 20}, 3);
  source.change().channels = {{.name = "a"}, {.name = "b", .value_scale = 0.5}, {.name = "ç", .value_offset = -10}};
  for (std::size_t c = 0; c < 3; ++c) source.set<std::uint8_t>({static_cast<int>(c), 2, 3}, 30, c);
  const auto built = [&](const BuildOptions& options) { return buildVolume(source, folder / "a.bwv", options).info; };
  VolumeInfo info = built({.empty_thresholds = {12}});
  EXPECT_EQ(info.channels[0].empty_threshold, 12);
  EXPECT_EQ(info.channels[1].empty_threshold, 24);
  EXPECT_EQ(info.channels[2].empty_threshold, 22);
  info = built({.empty_thresholds = {40, 12, 12}});
  EXPECT_EQ(info.channels[0].nonempty_voxels, 0u);
  EXPECT_EQ(info.channels[1].nonempty_voxels, 1u);
  EXPECT_EQ(info.channels[2].name, "ç");
  info = built({});  // a negative value in one channel leaves the others' threshold at 0
  EXPECT_EQ(info.channels[0].empty_threshold, 0);
  EXPECT_EQ(info.channels[2].empty_threshold, 0);
  EXPECT_EQ(info.channels[2].dataFromStored(info.channels[2].density_min), 20);
  EXPECT_THROW(built({.empty_thresholds = {1, 2}}), DataError);
}

TEST(ChannelsBuild, AVolumeOfNothingHasNoBlocks) {
  const ScratchFolder folder;
  MemorySource source(VoxelType::f32, {20, 20, 20}, 2);
  buildVolume(source, folder / "a.bwv", {});
  const VolumeFile file(folder / "a.bwv");
  EXPECT_EQ(file.info().levels[0].block_count, 0u);
  EXPECT_TRUE(file.readLevel(0, 1).blocks.empty());
  verifyVolume(source, folder / "a.bwv");
}

TEST(ChannelsBuild, RefusesWhatNoFileHolds) {
  const ScratchFolder folder;
  const auto message = [&](MemorySource source) {
    try {
      buildVolume(source, folder / "a.bwv", {});
    } catch (const DataError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(message(MemorySource(VoxelType::rgba8, {4, 4, 4}, 2)), HasSubstr("of rgba8 1"));
  EXPECT_THAT(message(MemorySource(VoxelType::u8, {4, 4, 4}, 5)), HasSubstr("must be 1..4"));
  MemorySource named(VoxelType::u8, {4, 4, 4}, 2);
  named.change().channels[1].name = std::string(65, 'x');
  EXPECT_THAT(message(named), HasSubstr("65 bytes, must be at most 64"));
  MemorySource single(VoxelType::u8, {4, 4, 4});
  single.change().channels[0].name = "alone";
  EXPECT_THAT(message(single), HasSubstr("a single channel has no name"));
}

}  // namespace
}  // namespace blockwalk::volume_test
