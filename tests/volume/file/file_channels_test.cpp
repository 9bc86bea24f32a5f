// SPDX-License-Identifier: Apache-2.0
// Version 2 of the file: several channels, and what a reader refuses of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/volume/file/file_contents.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"
#include "volume/error.h"
#include "volume/file/header.h"

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;

template <typename T>
T valueAt(const std::string& bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

template <typename T>
std::string raw(const T& value) {
  return std::string(reinterpret_cast<const char*>(&value), sizeof value);
}

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

// Makes the checksums of header and record sections right that were broken by a change on purpose.
void seal(std::string& bytes) {
  const auto all = std::as_writable_bytes(std::span(bytes));
  const auto header = valueAt<FileHeader>(bytes, 0);
  for (std::size_t i = 0; i < std::size_t{header.level_count} * header.channel_count; ++i) {
    const std::size_t at = sizeof(FileHeader) + i * sizeof(LevelEntry);
    auto entry = valueAt<LevelEntry>(bytes, at);
    for (Section* section : {&entry.blocks, &entry.subblocks}) {
      if (section->offset > bytes.size() || section->bytes > bytes.size() - section->offset) continue;
      section->checksum = checksumOf(all.subspan(section->offset, section->bytes));
    }
    bytes.replace(at, sizeof entry, raw(entry));
  }
  constexpr std::size_t kChecksum = offsetof(FileHeader, header_checksum);
  bytes.replace(kChecksum, 8, std::string(8, '\0'));
  bytes.replace(kChecksum, 8, raw(checksumOf(all.first(std::min<std::size_t>(header.header_bytes, bytes.size())))));
}

TEST(FileChannels, GoldenBytesOfVersion2) {
  // Whoever changes these bytes changes the format: then kFileVersionOfChannels and docs/format.md change too.
  const ScratchFolder folder;
  MemorySource source(VoxelType::u16, {20, 9, 5}, 2);
  source.change().name = "golden";
  source.change().channels = {{.name = "DAPI", .value_scale = 0.5}, {.name = "GFP", .value_offset = 3}};
  for (int i = 0; i < 60; ++i) {
    source.set<std::uint16_t>({i * 7 % 20, i * 5 % 9, i % 5}, static_cast<std::uint16_t>(i * 1000));
    source.set<std::uint16_t>({i % 7, i * 2 % 9, i % 3}, static_cast<std::uint16_t>(i * 900), 1);
  }
  buildVolume(source, folder / "golden.bwv", {.subblock_side = 4, .block_side = 2});
  const std::string bytes = readBytes(folder / "golden.bwv");
  EXPECT_EQ(bytes.substr(0, 12), std::string("BWVOL\r\n\x1a\x02\0\0\0", 12));
  EXPECT_EQ(valueAt<std::uint32_t>(bytes, 2284), 2u);
  EXPECT_EQ(bytes.size(), 18752u);
  EXPECT_EQ(checksumOf(std::as_bytes(std::span(bytes))), 4205513974394593050u);
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
  EXPECT_EQ(file.levelSectionBytes(0, 1), file.levelSectionBytes(0, 2));
}

struct ChannelFieldCase {
  const char* name;
  std::size_t offset;
  std::string bytes;
  const char* message;
};

TEST(FileChannels, ErrorsNameFieldOffsetAndBound) {
  const ScratchFolder folder;
  const std::string whole = smallChannelsFile(folder);
  const std::size_t levels = static_cast<std::uint8_t>(whole[offsetof(FileHeader, level_count)]);
  ASSERT_GT(levels, 2u);
  const std::size_t channels_at = sizeof(FileHeader) + levels * 3 * sizeof(LevelEntry);
  const auto inChannel = [&](std::size_t channel, std::size_t offset) {
    return channels_at + channel * sizeof(ChannelEntry) + offset;
  };
  const std::size_t second_entry = sizeof(FileHeader) + sizeof(LevelEntry);  // level 0, channel 1
  const auto counts = valueAt<LevelEntry>(whole, second_entry);
  const ChannelFieldCase cases[] = {
      {"version 1", 8, raw(1u), "channel_count at offset 2284 is 3, must be 0 in version 1"},
      {"version 3", 8, raw(3u), "version at offset 8 is 3, must be 1 or 2"},
      {"no channels", 2284, raw(0u), "channel_count at offset 2284 is 0, must be 2..4"},
      {"one channel", 2284, raw(1u), "channel_count at offset 2284 is 1, must be 2..4"},
      {"another number", 2284, raw(2u), "header_bytes"},
      {"many channels", 2284, raw(5u), "channel_count at offset 2284 is 5, must be 2..4"},
      {"colour", 32, raw(std::uint8_t{1}), "type at offset 32 is 1"},
      {"values in the header", 150, raw(std::uint8_t{1}), "channel at offset 150 is 1, must be 0"},
      {"scale", inChannel(1, 0), raw(0.0), "channel 1 value_scale"},
      {"offset", inChannel(2, 8), raw(std::nan("")), "channel 2 value_offset"},
      {"threshold", inChannel(0, 40), raw(std::nanf("")), "channel 0 empty_threshold"},
      {"range", inChannel(1, 48), raw(-1.0f), "channel 1 density_max"},
      {"cuts", inChannel(1, 60), raw(1e30f), "channel 1 bin_cuts"},
      {"histogram", inChannel(0, 88), raw(std::uint64_t{1} << 40), "channel 0 histogram"},
      {"nonempty", inChannel(1, 24), raw(~std::uint64_t{0}), "channel 1 nonempty_voxels"},
      {"name length", inChannel(1, 2136), raw(65u), "channel 1 name_bytes"},
      {"reserved", inChannel(1, 2140), raw(1u), "channel 1 reserved"},
      {"control character", inChannel(0, 2144), "\n", "channel 0 name"},
      {"broken UTF-8", inChannel(2, 2146), "\xff", "channel 2 name"},
      {"behind the name", inChannel(0, 2144 + 60), "x", "channel 0 name"},
      {"blocks", second_entry + 16, raw(counts.block_count + 1), "level block_count"},
      {"subblocks", second_entry + 24, raw(counts.subblock_count - 1), "channel 0's"},
      {"dims", second_entry, raw(1u), "level dims"},
      {"offset of a section", second_entry + 32, raw(counts.blocks.offset + 64), "block records offset"},
  };
  for (const ChannelFieldCase& field : cases) {
    SCOPED_TRACE(field.name);
    std::string broken = whole;
    broken.replace(field.offset, field.bytes.size(), field.bytes);
    seal(broken);
    writeBytes(folder / "broken.bwv", broken);
    EXPECT_THAT(messageOf(folder / "broken.bwv"), HasSubstr(field.message));
  }
}

TEST(FileChannels, BrokenRecordsNameTheirOffset) {
  const ScratchFolder folder;
  const std::string whole = smallChannelsFile(folder);
  const std::uint64_t record = blockRecordBytes(VoxelType::u8, 2);
  const auto second = valueAt<LevelEntry>(whole, sizeof(FileHeader) + sizeof(LevelEntry));
  const auto third = valueAt<LevelEntry>(whole, sizeof(FileHeader) + 2 * sizeof(LevelEntry));
  const auto breaks = [&](std::uint64_t at, const std::string& bytes, const char* what) {
    std::string broken = whole;
    broken.replace(at, bytes.size(), bytes);
    ASSERT_NE(broken, whole) << what;
    seal(broken);
    writeBytes(folder / "broken.bwv", broken);
    EXPECT_THAT(messageOf(folder / "broken.bwv"), HasSubstr(what)) << at;
  };
  // The first subblock of channel 2 is empty: 0, 0, 0.
  ASSERT_EQ(whole.substr(third.subblocks.offset, 3), std::string(3, '\0'));
  breaks(third.subblocks.offset, "\x05", "level 0 channel 2 record");
  breaks(third.subblocks.offset + 1, "\x05", "density max is 5, must be 0 where the channel is empty");
  breaks(third.subblocks.offset + 2, "\x01", "density min is 0");
  breaks(third.blocks.offset + 6, "\x01", "range mask is 1");
  breaks(third.blocks.offset + 9, "\x01", "density max");
  // Another subblock in the same block, or the block elsewhere, and the records themselves stay right.
  std::uint64_t block = second.blocks.offset;
  const auto occupancy = [&] { return static_cast<std::uint8_t>(whole[block + record - 1]); };
  while (occupancy() == 0xff) block += record;
  const auto moved = static_cast<std::uint8_t>(occupancy() << 1 | occupancy() >> 7);
  ASSERT_NE(moved, occupancy());
  breaks(block + record - 1, raw(moved), "channel 0's");
  const std::uint64_t last = second.blocks.offset + (second.block_count - 1) * record;
  breaks(last + 4, raw(static_cast<std::uint16_t>(valueAt<std::uint16_t>(whole, last + 4) + 1)), "origin");
}

TEST(FileChannels, EveryTruncationIsAnError) {
  const ScratchFolder folder;
  const std::string whole = smallChannelsFile(folder);
  ASSERT_NO_THROW(readContents(folder / "small.bwv"));
  writeBytes(folder / "cut.bwv", whole);
  for (std::size_t size = whole.size(); size-- > 0;) {
    if (size > 2500 && size + 100 < whole.size() && size % 37 != 0) continue;
    std::filesystem::resize_file(folder / "cut.bwv", size);
    EXPECT_THROW(readContents(folder / "cut.bwv"), DataError) << size;
  }
}

TEST(FileChannels, AFlippedBitIsAnErrorOrChangesNothing) {
  const ScratchFolder folder;
  const std::string whole = smallChannelsFile(folder);
  const std::string expected = readContents(folder / "small.bwv");
  std::mt19937 random(7);
  int errors = 0;
  for (int i = 0; i < 1500; ++i) {
    std::string broken = whole;
    const std::size_t at = random() % (i % 2 == 0 ? 12000 : whole.size());
    broken[at] = static_cast<char>(broken[at] ^ (1 << random() % 8));
    writeBytes(folder / "flipped.bwv", broken);
    try {
      EXPECT_EQ(readContents(folder / "flipped.bwv"), expected) << "byte " << at;
    } catch (const DataError&) {
      ++errors;
    }
  }
  EXPECT_GT(errors, 1400);  // only padding between sections may be anything
}

}  // namespace
}  // namespace blockwalk::volume_test
