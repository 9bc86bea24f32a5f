// SPDX-License-Identifier: Apache-2.0
// A file of several channels, and what a reader refuses of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/volume/file/broken_file.h"
#include "tests/volume/file/file_contents.h"
#include "tests/volume/file/seal.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"
#include "volume/error.h"

namespace blockwalk::volume_test {
namespace {

// Three channels on several levels; channel 2 is empty but for one voxel.
std::string smallChannelsFile(const ScratchFolder& folder) {
  MemorySource source = randomSource(VoxelType::u8, {41, 23, 19}, 31, false, 3);
  source.change().channels = {{.name = "red"}, {.name = "green", .value_scale = 2}, {.name = "blå"}};
  std::fill(source.voxels.begin() + static_cast<std::ptrdiff_t>(source.voxels.size() / 3 * 2), source.voxels.end(),
            std::byte{0});
  source.set<std::uint8_t>({20, 20, 3}, 77, 2);
  buildVolume(source, folder / "small.bwv", {.subblock_side = 4, .block_side = 2});
  return readBytes(folder / "small.bwv");
}

TEST(FileChannels, SaysWhatItsChannelsAre) {
  const ScratchFolder folder;
  smallChannelsFile(folder);
  const VolumeFile file(folder / "small.bwv");
  ASSERT_EQ(file.info().channels.size(), 3u);
  EXPECT_EQ(file.info().channels[0].name, "red");
  EXPECT_EQ(file.info().channels[2].name, "blå");
  EXPECT_EQ(file.info().channels[1].value_scale, 2);
  EXPECT_EQ(file.info().channels[2].nonempty_voxels, 1u);
}

TEST(FileChannels, ErrorsNameFieldOffsetAndBound) {
  const ScratchFolder folder;
  const std::string whole = smallChannelsFile(folder);
  const auto inChannel = [&](std::size_t channel, std::size_t offset) {
    return channelEntryAt(whole, channel) + offset;
  };
  const FieldCase cases[] = {
      {"another number", 144, raw(2u), "header_bytes"},
      {"colour", 32, raw(std::uint8_t{1}), "channel_count at offset 144 is 3, must be 1 for rgba8"},
      {"scale", inChannel(1, 0), raw(0.0), "channel 1 value_scale"},
      {"offset", inChannel(2, 8), raw(std::nan("")), "channel 2 value_offset"},
      {"threshold", inChannel(0, 40), raw(std::nanf("")), "channel 0 empty_threshold"},
      {"range", inChannel(1, 48), raw(-1.0f), "channel 1 density_max"},
      {"cuts", inChannel(1, 60), raw(1e30f), "channel 1 bin_cuts"},
      {"histogram", inChannel(0, 88), raw(std::uint64_t{1} << 40), "channel 0 histogram"},
      {"nonempty", inChannel(1, 24), raw(~std::uint64_t{0}), "channel 1 nonempty_voxels"},
      {"offset of a section", sectionsAt(whole, 0, 1), raw(std::uint64_t{64}), "level 0 channel 1 ranges offset"},
  };
  expectErrors(whole, cases, Sealed::all);
}

TEST(FileChannels, BrokenRecordsNameTheirOffset) {
  const ScratchFolder folder;
  const std::string whole = smallChannelsFile(folder);
  const auto third = valueAt<ChannelSections>(whole, sectionsAt(whole, 0, 2));
  // The first subblock of channel 2 is empty: 0, 0, 0.
  ASSERT_EQ(whole.substr(third.ranges.offset, 3), std::string(3, '\0'));
  const FieldCase cases[] = {
      {"least", third.ranges.offset, "\x05", "level 0 channel 2 record"},
      {"greatest", third.ranges.offset + 1, "\x05", "density max is 5, must be 0 where the channel is empty"},
      {"mask", third.ranges.offset + 2, "\x01", "density min is 0"},
  };
  expectErrors(whole, cases, Sealed::all);
}

TEST(FileChannels, EveryTruncationIsAnError) {
  expectTruncationsFail(smallChannelsFile(ScratchFolder()), {.thorough = 2500, .end = 100, .step = 37});
}

TEST(FileChannels, AFlippedBitIsAnErrorOrChangesNothing) {
  EXPECT_GT(expectFlipsAreNoticed(smallChannelsFile(ScratchFolder()), 1500, 12000), 1000);
}

}  // namespace
}  // namespace blockwalk::volume_test
