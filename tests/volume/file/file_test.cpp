// SPDX-License-Identifier: Apache-2.0
#include "volume/file/file.h"
#include "volume/file/checksum.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <cstddef>
#include <filesystem>

#include "tests/volume/file/broken_file.h"
#include "tests/volume/file/file_contents.h"
#include "tests/volume/file/seal.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"
#include "volume/error.h"

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;

// A file of several levels and about 30 KiB.
std::string smallFile(const ScratchFolder& folder, VoxelType type = VoxelType::u8) {
  MemorySource source = randomSource(type, {41, 23, 19}, 31);
  source.change().name = "small";
  source.change().world_from_index[3] = glm::dvec4(1, 2, 3, 1);
  buildVolume(source, folder / "small.bwv", {.subblock_side = 4, .block_side = 2});
  return readBytes(folder / "small.bwv");
}

// Everything the format has on one small file: channels, names, levels, subblocks of which only the apron has voxels.
TEST(File, GoldenBytesOfVersion3) {
  // Whoever changes these bytes changes the format: then kFileVersion and docs/format.md change too.
  const ScratchFolder folder;
  MemorySource source(VoxelType::u16, {20, 9, 5}, 2);
  source.change().name = "golden";
  source.change().channels = {{.name = "DAPI", .value_scale = 0.5}, {.name = "GFP", .value_offset = 3}};
  source.change().world_from_index =
      glm::dmat4(glm::dvec4(2, 0, 0, 0), glm::dvec4(0, 3, 0, 0), glm::dvec4(0, 0, 1, 0), glm::dvec4(-1, 0, 4, 1));
  for (int i = 0; i < 60; ++i) {
    source.set<std::uint16_t>({i * 7 % 20, i * 5 % 9, i % 5}, static_cast<std::uint16_t>(i * 1000));
    source.set<std::uint16_t>({i % 7, i * 2 % 9, i % 3}, static_cast<std::uint16_t>(i * 900), 1);
  }
  buildVolume(source, folder / "golden.bwv", {.subblock_side = 4, .block_side = 2});
  const std::string bytes = readBytes(folder / "golden.bwv");
  EXPECT_EQ(bytes.substr(0, 12), std::string("BWVOL\r\n\x1a\x03\0\0\0", 12));
  EXPECT_EQ(bytes.size(), 18176u);
  EXPECT_EQ(checksumOf(std::as_bytes(std::span(bytes))), 16729553246019980665u);
}

TEST(File, AnOlderVersionIsRefusedWithTheCommandThatMakesItAnew) {
  const ScratchFolder folder;
  const std::string whole = smallFile(folder);
  for (const std::uint32_t version : {1u, 2u}) {
    std::string older = whole;
    older.replace(8, 4, raw(version));
    writeBytes(folder / "older.bwv", older);
    const std::string path = (folder / "older.bwv").string();
    EXPECT_EQ(messageOf(folder / "older.bwv"),
              fmt::format("{}: version {} of the format, which is no longer read; make it anew from its source: "
                          "blockwalk import SOURCE -o {}",
                          path, version, path));
  }
}

TEST(File, EveryTruncationIsAnError) {
  expectTruncationsFail(smallFile(ScratchFolder()), {.thorough = 3500, .end = 300, .step = 7});
}

TEST(File, TrailingBytesAreRefused) {
  const ScratchFolder folder;
  const std::string whole = smallFile(folder);
  for (std::size_t more : {1, 8, 5000}) {
    writeBytes(folder / "long.bwv", whole + std::string(more, '\0'));
    EXPECT_THAT(messageOf(folder / "long.bwv"), HasSubstr("file_bytes at offset 16"));
  }
}

TEST(File, AFlippedBitIsAnErrorOrChangesNothing) {
  for (VoxelType type : {VoxelType::rgba8, VoxelType::f32}) {
    EXPECT_GT(expectFlipsAreNoticed(smallFile(ScratchFolder(), type), 2000, 4000), 1000);
  }
}

TEST(File, EveryHeaderByteIsBoundedEvenWithARightChecksum) {
  const ScratchFolder folder;
  const std::string whole = smallFile(folder);
  std::uint32_t header_bytes = 0;
  std::memcpy(&header_bytes, whole.data() + offsetof(FileHeader, header_bytes), sizeof header_bytes);
  int errors = 0;
  for (std::size_t at = 0; at < header_bytes; ++at) {
    for (const char value : {'\0', '\x7f', '\xff'}) {
      std::string broken = whole;
      broken[at] = value;
      if (at < offsetof(FileHeader, header_bytes) || at >= offsetof(FileHeader, type)) sealHeader(broken);
      writeBytes(folder / "broken.bwv", broken);
      try {
        readContents(folder / "broken.bwv");  // a changed name or scale is right; nothing may crash
      } catch (const DataError&) {
        ++errors;
      }
    }
  }
  EXPECT_GT(errors, 1000);
}

TEST(File, ErrorsNameFieldOffsetAndBound) {
  const ScratchFolder folder;
  const std::string whole = smallFile(folder);
  constexpr std::size_t kLevel0 = sizeof(FileHeader);
  const std::size_t sections = sectionsAt(whole, 0, 0);
  const std::size_t channel = channelEntryAt(whole, 0);
  const auto at = [](std::size_t offset) { return fmt::format("at offset {}", offset); };
  const FieldCase cases[] = {
      {"magic", 0, "X", "not a .bwv file"},
      {"version", 8, raw(4u), "version at offset 8 is 4, must be 3"},
      {"header_bytes", 12, raw(0xffffffffu), "header_bytes at offset 12"},
      {"file_bytes", 16, raw(std::uint64_t{1} << 62), "file_bytes at offset 16"},
      {"type", 32, raw(std::uint8_t{5}), "type at offset 32 is 5"},
      {"subblock_side", 33, raw(std::uint8_t{7}), "subblock_side at offset 33 is 7, must be 4, 8 or 16"},
      {"block_side", 34, raw(std::uint8_t{7}), "block_side at offset 34 is 7, must be 1..6"},
      {"level_count", 35, raw(std::uint8_t{0}), "level_count at offset 35"},
      {"dims 0", 36, raw(0u), "dims at offset 36 is 0, must be 1..65536"},
      {"dims 65537", 44, raw(65537u), "dims at offset 44 is 65537, must be 1..65536"},
      {"dims negative", 40, raw(0x80000000u), "dims at offset 40"},
      {"dims other", 36, raw(42u), "level 0 dims at offset 192 is 41, must be 42"},
      {"singular map", 48, std::string(96, '\0'), "determinant"},
      {"map NaN", 48, raw(std::nan("")), "world_from_index at offset 48 is nan"},
      {"no channels", 144, raw(0u), "channel_count at offset 144 is 0, must be 1..4"},
      {"many channels", 144, raw(5u), "channel_count at offset 144 is 5, must be 1..4"},
      {"another number of channels", 144, raw(2u), "header_bytes"},
      {"metadata", 148, raw(0xffffffffu), "metadata_bytes at offset 148"},
      {"part", 156, raw(1u), "part_origin at offset 156 is 1, must be 0 in version 3"},
      {"whole", 164, raw(1u), "whole_dims at offset 164 is 1, must be 0 in version 3"},
      {"step", 176, raw(1u), "time_step at offset 176 is 1, must be 0 in version 3"},
      {"steps", 180, raw(1u), "time_steps at offset 180 is 1, must be 0 in version 3"},
      {"maxima", 184, raw(1u), "maxima_count at offset 184 is 1, must be 0 or 2, for level 2 and on"},
      {"group_records", 188, raw(1u), "group_records at offset 188 is 1, must be 0 or 1024"},
      {"scale 0", channel, raw(0.0), "value_scale " + at(channel) + " is 0"},
      {"scale negative", channel, raw(-1.0), "value_scale"},
      {"offset", channel + 8, raw(std::numeric_limits<double>::infinity()), "value_offset " + at(channel + 8)},
      {"threshold", channel + 40, raw(std::nanf("")), "empty_threshold"},
      {"cuts", channel + 60, raw(1e30f), "bin_cuts " + at(channel + 64)},
      {"values", channel + 2136, raw(std::uint8_t{2}), "values " + at(channel + 2136) + " is 2"},
      {"channel's reserved", channel + 2139, "x", "reserved " + at(channel + 2139)},
      {"level dims", levelEntryAt(1), raw(1u), "level 1 dims " + at(levelEntryAt(1)) + " is 1"},
      {"level's reserved", kLevel0 + 12, raw(1u), "level 0 reserved"},
      {"blocks", kLevel0 + 16, raw(~std::uint64_t{0}), "level 0 block_count at offset 208"},
      {"subblocks", kLevel0 + 24, raw(~std::uint64_t{0}), "level 0 subblock_count at offset 216"},
      {"apron blocks", kLevel0 + 32, raw(~std::uint64_t{0}), "level 0 apron_block_count at offset 224"},
      {"apron subblocks", kLevel0 + 40, raw(~std::uint64_t{0}), "level 0 apron_subblock_count at offset 232"},
      {"overlap", kLevel0 + 48, raw(std::uint64_t{0}), "level 0 block records offset at offset 240"},
      {"size", kLevel0 + 56, raw(~std::uint64_t{0}), "level 0 block records size at offset 248"},
      {"ranges", sections + 8, raw(~std::uint64_t{0}), "level 0 channel 0 ranges size"},
      {"pages", sections + 48, raw(std::uint64_t{64}), "level 0 channel 0 pages offset"},
      {"voxels", sections + 72, raw(~std::uint64_t{63}), "level 0 channel 0 voxels offset"},
      {"voxels' size", sections + 80, raw(~std::uint64_t{0}), "level 0 channel 0 voxels size"},
      {"voxels' checksum", sections + 88, raw(1u), "level 0 channel 0 voxels checksum"},
  };
  expectErrors(whole, cases, Sealed::header);
}

TEST(File, ALevelHoldsNoMoreSubblocksThanAKernelCounts) {
  // The header of a file that would take terabytes.
  const auto decode = [](std::uint64_t subblocks) {
    VolumeInfo info;
    info.dims = glm::ivec3(65536);
    info.subblock_side = 4;
    info.block_side = 1;
    info.channels[0].nonempty_voxels = subblocks;
    info.channels[0].histogram[0] = subblocks;
    info.channels[0].density_min = 1;
    info.channels[0].density_max = 1;
    info.channels[0].histogram_hi = 1;
    const int levels = levelCount(info.dims, info.blockVoxels());
    for (int level = 0; level < levels; ++level) info.levels.push_back({.dims = levelDims(info.dims, level)});
    info.levels[0].block_count = info.levels[0].apron_block_count = subblocks;
    info.levels[0].subblock_count = info.levels[0].apron_subblock_count = subblocks;
    FileSizes sizes;
    sizes.blocks.resize(info.levels.size());
    sizes.voxels.resize(info.levels.size());
    sizes.blocks[0] = subblocks * kLeastBlockRecordBytes;
    sizes.voxels[0] = subblocks * 64;
    const FileLayout layout = layOutFile(info, sizes);
    const std::vector<std::byte> header = encodeHeader(info, layout, "");
    return decodeHeader(header, layout.file_bytes, "huge.bwv").info.levels[0].subblock_count;
  };
  EXPECT_EQ(decode(kMaxSubblocks), kMaxSubblocks);
  try {
    decode(kMaxSubblocks + 1);
    FAIL() << "was not refused";
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("huge.bwv: header field level 0 apron_subblock_count at offset 232 is 4294967295, "
                          "must be at most 4294967294"));
  }
}

TEST(File, BrokenRecordsNameTheirOffset) {
  const ScratchFolder folder;
  smallFile(folder);
  const std::string whole = readBytes(folder / "small.bwv");
  const auto entry = valueAt<LevelEntry>(whole, levelEntryAt(0));
  const auto sections = valueAt<ChannelSections>(whole, sectionsAt(whole, 0, 0));
  ASSERT_GT(entry.block_count, 2u);
  ASSERT_GT(entry.apron_subblock_count, entry.subblock_count);
  const auto breaks = [&](std::uint64_t at, std::string bytes, const char* what) {
    std::string broken = whole;
    broken.replace(at, bytes.size(), bytes);
    ASSERT_NE(broken, whole) << what;
    seal(broken);
    writeBytes(folder / "broken.bwv", broken);
    EXPECT_THAT(messageOf(folder / "broken.bwv"), HasSubstr(what)) << at;
  };
  const std::uint64_t block = entry.blocks.offset;
  breaks(block, "\xff\xff", "origin is 65535, must be below 6 on axis 0");
  breaks(block + 6, "\xff", "bytes of an origin and two ascending sets");
  breaks(block + 6, std::string(2, '\0'), "bytes of an origin and two ascending sets");
  breaks(block + 8, std::string(1, '\0'), "bytes of an origin and two ascending sets");
  const std::uint64_t ranges = sections.ranges.offset;
  breaks(ranges, "\xff\x01", "density max is 1");
  breaks(ranges, std::string(1, '\0'), "density min is 0");
  breaks(ranges + 2, std::string(1, '\0'), "range mask is 0");
  breaks(sections.apron_ranges.offset, "\xff\x01", "apron density max is 1");
  const std::uint64_t page = sections.pages.offset;
  breaks(page + 8, raw(1u), "page bytes is 1");
  breaks(page + 12, "\x03", "page codec is 3, must be 0 (raw), 1 (lz4) or 2 (zstd)");
  breaks(page + 13, std::string(1, '\0'), "page subblocks is 0, must be 1..8");
  breaks(page + 14, "\x01", "page reserved is 1");
  // Two pages whose blocks have each other's number of subblocks.
  const auto first = valueAt<PageEntry>(whole, page);
  std::uint64_t other = page + sizeof(PageEntry);
  while (valueAt<PageEntry>(whole, other).subblocks == first.subblocks) other += sizeof(PageEntry);
  ASSERT_LT(other, page + sections.pages.bytes);
  std::string swapped = whole.substr(page, other - page + sizeof(PageEntry));
  swapped.replace(0, sizeof(PageEntry), whole, other, sizeof(PageEntry));
  swapped.replace(other - page, sizeof(PageEntry), whole, page, sizeof(PageEntry));
  breaks(page, swapped, "page's first subblock");
}

TEST(File, BlocksOutOfOrderAreRefused) {
  const ScratchFolder folder;
  // Two blocks of one subblock each: their records have the same length.
  MemorySource source(VoxelType::u8, {32, 8, 8});
  source.set<std::uint8_t>({2, 2, 2}, 9);
  source.set<std::uint8_t>({18, 2, 2}, 9);
  buildVolume(source, folder / "two.bwv", {.subblock_side = 4, .block_side = 2});
  std::string bytes = readBytes(folder / "two.bwv");
  const auto entry = valueAt<LevelEntry>(bytes, levelEntryAt(0));
  ASSERT_EQ(entry.apron_block_count, 2u);
  const std::string records = bytes.substr(entry.blocks.offset, entry.blocks.bytes);
  const std::size_t half = records.size() / 2;
  bytes.replace(entry.blocks.offset, records.size(), records.substr(half) + records.substr(0, half));
  seal(bytes);
  writeBytes(folder / "two.bwv", bytes);
  EXPECT_THAT(messageOf(folder / "two.bwv"), HasSubstr("Morton code"));
}

TEST(File, AReadTouchesOnlyThePagesOfWhatItReturns) {
  const ScratchFolder folder;
  MemorySource source(VoxelType::u8, {192, 96, 96});
  std::ranges::fill(source.voxels, std::byte{7});
  buildVolume(source, folder / "full.bwv", {});
  const VolumeFile file(folder / "full.bwv");
  const Level level = file.readLevel(0, 0);
  ASSERT_EQ(level.blocks.size(), 16u);
  for (const Block& block : level.blocks) {
    std::vector<std::byte> voxels(block.subblock_count * std::size_t{512});
    const std::uint64_t before = file.bytesRead();
    file.readVoxels(0, 0, block.first_subblock, block.subblock_count, voxels);
    EXPECT_EQ(file.bytesRead() - before, voxels.size());
  }
}

TEST(File, OnlyRegularFilesAreOpened) {
  const ScratchFolder folder;
  EXPECT_THROW(VolumeFile(folder / "none.bwv"), DataError);
  EXPECT_THROW(VolumeFile(folder.path), DataError);
  EXPECT_THROW(VolumeFile("/dev/zero"), DataError);
  ASSERT_EQ(mkfifo((folder / "fifo.bwv").c_str(), 0600), 0);
  EXPECT_THROW(VolumeFile(folder / "fifo.bwv"), DataError);  // and does not wait for a writer
  writeBytes(folder / "empty.bwv", "");
  EXPECT_THROW(VolumeFile(folder / "empty.bwv"), DataError);
}

TEST(File, AFileThatShrinksIsAnError) {
  const ScratchFolder folder;
  const std::string whole = smallFile(folder);
  const VolumeFile file(folder / "small.bwv");
  std::vector<std::byte> voxels(64);
  EXPECT_NO_THROW(file.readVoxels(0, 0, 0, 1, voxels));
  std::filesystem::resize_file(folder / "small.bwv", 100);
  EXPECT_THROW(file.readVoxels(0, 0, 0, 1, voxels), DataError);
  EXPECT_THROW(file.readLevel(0, 0), DataError);
}

TEST(File, ADeletedFileStaysReadable) {
  const ScratchFolder folder;
  smallFile(folder);
  const std::string expected = readContents(folder / "small.bwv");
  VolumeFile first(folder / "small.bwv");
  std::filesystem::remove(folder / "small.bwv");
  const VolumeFile file = std::move(first);
  std::vector<std::byte> voxels(static_cast<std::size_t>(file.info().levels[0].voxel_bytes));
  EXPECT_NO_THROW(file.readVoxels(0, 0, 0, file.info().levels[0].subblock_count, voxels));
}

TEST(File, OneSubblockABlockStaysWithinATenthOfItsVoxels) {
  // The worst case of the default sides: every block holds a single subblock of 512 bytes.
  const ScratchFolder folder;
  MemorySource source(VoxelType::u8, {480, 480, 480});
  for (int z = 0; z < 480; z += 48) {
    for (int y = 0; y < 480; y += 48) {
      for (int x = 0; x < 480; x += 48) source.set<std::uint8_t>({x + 9, y + 20, z + 30}, 200);
    }
  }
  const BuildReport report = buildVolume(source, folder / "sparse.bwv", {});
  EXPECT_EQ(report.level0_voxel_bytes, 1000u * 512);
  EXPECT_LE(static_cast<double>(report.level0_voxel_bytes + report.overhead_bytes),
            1.10 * static_cast<double>(report.level0_voxel_bytes));
  EXPECT_EQ(std::filesystem::file_size(folder / "sparse.bwv"), report.file_bytes);
}

TEST(File, RecordsComeBeforeVoxelsAndCoarseLevelsFirst) {
  const ScratchFolder folder;
  const std::string whole = smallFile(folder);
  const auto header = valueAt<FileHeader>(whole, 0);
  ASSERT_GT(header.level_count, 3);
  ASSERT_EQ(header.maxima_count, header.level_count - 2u);
  // Coarsest first, values before maxima.
  std::vector<std::size_t> order;
  for (std::size_t level = header.level_count; level-- > 0;) {
    order.push_back(level);
    if (level >= 2) order.push_back(header.level_count + level - 2);
  }
  std::uint64_t end = header.header_bytes;
  const auto follows = [&end](const Section& section) {
    EXPECT_EQ(section.offset, (end + 63) / 64 * 64);
    end = section.offset + section.bytes;
  };
  for (const std::size_t i : order) {
    follows(valueAt<LevelEntry>(whole, levelEntryAt(i)).blocks);
    const auto sections = valueAt<ChannelSections>(whole, sectionsAt(whole, i, 0));
    for (const Section& section : {sections.ranges, sections.apron_ranges, sections.pages}) follows(section);
  }
  for (const std::size_t i : order) follows(valueAt<ChannelSections>(whole, sectionsAt(whole, i, 0)).voxels);
  EXPECT_EQ(end, whole.size());
}

}  // namespace
}  // namespace blockwalk::volume_test
