// SPDX-License-Identifier: Apache-2.0
#include "volume/file/file.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <cstddef>
#include <filesystem>

#include "tests/volume/file/file_contents.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"
#include "volume/error.h"
#include "volume/file/header.h"

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

// Puts the right checksum into a header that was changed on purpose.
void sealHeader(std::string& bytes) {
  std::uint32_t header_bytes = 0;
  std::memcpy(&header_bytes, bytes.data() + offsetof(FileHeader, header_bytes), sizeof header_bytes);
  std::memset(bytes.data() + offsetof(FileHeader, header_checksum), 0, 8);
  const std::uint64_t checksum = checksumOf(std::as_bytes(std::span(bytes.data(), header_bytes)));
  std::memcpy(bytes.data() + offsetof(FileHeader, header_checksum), &checksum, sizeof checksum);
}

TEST(File, GoldenBytesOfVersion1) {
  // Whoever changes these bytes changes the format: then kFileVersion and docs/format.md change too.
  const ScratchFolder folder;
  MemorySource source(VoxelType::u16, {20, 9, 5});
  source.change().name = "golden";
  source.change().channels[0].value_scale = 0.5;
  source.change().world_from_index =
      glm::dmat4(glm::dvec4(2, 0, 0, 0), glm::dvec4(0, 3, 0, 0), glm::dvec4(0, 0, 1, 0), glm::dvec4(-1, 0, 4, 1));
  for (int i = 0; i < 60; ++i)
    source.set<std::uint16_t>({i * 7 % 20, i * 5 % 9, i % 5}, static_cast<std::uint16_t>(i * 1000));
  buildVolume(source, folder / "golden.bwv", {.subblock_side = 4, .block_side = 2});
  const std::string bytes = readBytes(folder / "golden.bwv");
  EXPECT_EQ(bytes.substr(0, 16), std::string("BWVOL\r\n\x1a\x01\0\0\0\x76\x0a\0\0", 16));
  EXPECT_EQ(bytes.size(), 7104u);
  EXPECT_EQ(checksumOf(std::as_bytes(std::span(bytes))), 9278511935060223352u);
}

TEST(File, EveryTruncationIsAnError) {
  const ScratchFolder folder;
  const std::string whole = smallFile(folder);
  ASSERT_NO_THROW(readContents(folder / "small.bwv"));
  writeBytes(folder / "cut.bwv", whole);
  // Downwards in place; every length near the header and the end, then every 7th.
  for (std::size_t size = whole.size(); size-- > 0;) {
    if (size > 3500 && size + 300 < whole.size() && size % 7 != 0) continue;
    std::filesystem::resize_file(folder / "cut.bwv", size);
    EXPECT_THROW(readContents(folder / "cut.bwv"), DataError) << size;
  }
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
  const ScratchFolder folder;
  for (VoxelType type : {VoxelType::rgba8, VoxelType::f32}) {
    const std::string whole = smallFile(folder, type);
    const std::string expected = readContents(folder / "small.bwv");
    std::mt19937 random(7);
    int errors = 0;
    for (int i = 0; i < 2000; ++i) {
      std::string broken = whole;
      // Every other one in the header and the first records.
      const std::size_t at = random() % (i % 2 == 0 ? 4000 : whole.size());
      broken[at] = static_cast<char>(broken[at] ^ (1 << random() % 8));
      writeBytes(folder / "flipped.bwv", broken);
      try {
        EXPECT_EQ(readContents(folder / "flipped.bwv"), expected) << "byte " << at;
      } catch (const DataError&) {
        ++errors;
      }
    }
    EXPECT_GT(errors, 1900);  // only padding between sections may be anything
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

struct FieldCase {
  const char* name;
  std::size_t offset;
  std::string bytes;
  const char* message;
};

TEST(File, ErrorsNameFieldOffsetAndBound) {
  const ScratchFolder folder;
  const std::string whole = smallFile(folder);
  const auto raw = [](auto value) { return std::string(reinterpret_cast<const char*>(&value), sizeof value); };
  constexpr std::size_t kLevel0 = sizeof(FileHeader);
  const FieldCase cases[] = {
      {"magic", 0, "X", "not a .bwv file"},
      {"version", 8, raw(3u), "version at offset 8 is 3, must be 1 or 2"},
      {"header_bytes", 12, raw(0xffffffffu), "header_bytes at offset 12"},
      {"file_bytes", 16, raw(std::uint64_t{1} << 62), "file_bytes at offset 16"},
      {"type", 32, raw(std::uint8_t{5}), "type at offset 32 is 5"},
      {"subblock_side", 33, raw(std::uint8_t{7}), "subblock_side at offset 33 is 7, must be 4, 8 or 16"},
      {"block_side", 34, raw(std::uint8_t{7}), "block_side at offset 34 is 7, must be 1..6"},
      {"level_count", 35, raw(std::uint8_t{0}), "level_count at offset 35"},
      {"dims 0", 36, raw(0u), "dims at offset 36 is 0, must be 1..65536"},
      {"dims 65537", 44, raw(65537u), "dims at offset 44 is 65537, must be 1..65536"},
      {"dims negative", 40, raw(0x80000000u), "dims at offset 40"},
      {"dims other", 36, raw(42u), "histogram"},
      {"singular map", 48, std::string(96, '\0'), "determinant"},
      {"map NaN", 48, raw(std::nan("")), "world_from_index at offset 48 is nan"},
      {"scale 0", 144, raw(0.0), "value_scale at offset 144 is 0"},
      {"scale negative", 144, raw(-1.0), "value_scale"},
      {"offset", 152, raw(std::numeric_limits<double>::infinity()), "value_offset at offset 152 is inf"},
      {"threshold", 184, raw(std::nanf("")), "empty_threshold"},
      {"cuts", 204, raw(1e30f), "bin_cuts at offset 208"},
      {"name", 2280, raw(0xffffffffu), "source_name_bytes at offset 2280"},
      {"level dims", kLevel0, raw(1u), "level dims at offset 2288 is 1"},
      {"blocks", kLevel0 + 16, raw(~std::uint64_t{0}), "level block_count at offset 2304"},
      {"subblocks", kLevel0 + 24, raw(~std::uint64_t{0}), "level subblock_count at offset 2312"},
      {"overlap", kLevel0 + 32, raw(std::uint64_t{0}), "block records offset at offset 2320"},
      {"size", kLevel0 + 40, raw(~std::uint64_t{0}), "block records size at offset 2328"},
      {"voxels", kLevel0 + 104, raw(~std::uint64_t{63}), "voxels offset at offset 2392"},
  };
  for (const FieldCase& field : cases) {
    SCOPED_TRACE(field.name);
    std::string broken = whole;
    broken.replace(field.offset, field.bytes.size(), field.bytes);
    if (field.offset >= 32) sealHeader(broken);
    writeBytes(folder / "broken.bwv", broken);
    const std::string message = messageOf(folder / "broken.bwv");
    if (std::string(field.name) != "dims other") {
      EXPECT_THAT(message, HasSubstr(field.message));
    }
    EXPECT_THAT(message, HasSubstr("broken.bwv: "));
  }
}

TEST(File, BrokenRecordsNameTheirOffset) {
  const ScratchFolder folder;
  smallFile(folder);
  const std::string whole = readBytes(folder / "small.bwv");
  LevelEntry entry;
  std::memcpy(&entry, whole.data() + sizeof(FileHeader), sizeof entry);
  ASSERT_GT(entry.block_count, 2u);
  const auto breaks = [&](std::uint64_t at, std::string bytes, const char* what) {
    std::string broken = whole;
    broken.replace(at, bytes.size(), bytes);
    // A right checksum, so that the record itself is judged.
    LevelEntry sealed = entry;
    const auto section = [&](Section& which) {
      which.checksum = checksumOf(std::as_bytes(std::span(broken.data() + which.offset, which.bytes)));
    };
    section(sealed.blocks);
    section(sealed.subblocks);
    std::memcpy(broken.data() + sizeof(FileHeader), &sealed, sizeof sealed);
    sealHeader(broken);
    writeBytes(folder / "broken.bwv", broken);
    EXPECT_THAT(messageOf(folder / "broken.bwv"), HasSubstr(what)) << at;
  };
  const std::uint64_t block = entry.blocks.offset;
  const std::uint64_t record = blockRecordBytes(VoxelType::u8, 2);
  breaks(block, "\xff\xff", "origin is 65535, must be below 6 on axis 0");
  breaks(block + record, whole.substr(block, record), "Morton code");
  breaks(block + 6, std::string(1, '\0'), "range mask is 0");
  breaks(block + 7, std::string(1, '\0'), "subblock count is 0");
  breaks(block + 8, "\xff", "density min");
  breaks(block + 10, std::string(1, '\0'), "subblock count");
  breaks(entry.subblocks.offset, "\xff\x01", "density max is 1");
  breaks(entry.subblocks.offset, std::string(1, '\0'), "density min is 0");
  breaks(entry.subblocks.offset + 2, std::string(1, '\0'), "range mask is 0");
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

TEST(File, APrefixHoldsTheCoarserLevels) {
  const ScratchFolder folder;
  const std::string whole = smallFile(folder);
  std::uint64_t end = 0;
  std::vector<LevelEntry> entries(static_cast<std::uint8_t>(whole[offsetof(FileHeader, level_count)]));
  std::memcpy(entries.data(), whole.data() + sizeof(FileHeader), entries.size() * sizeof(LevelEntry));
  ASSERT_GT(entries.size(), 2u);
  for (std::size_t i = entries.size(); i-- > 0;) {
    for (const Section& section :
         {entries[i].blocks, entries[i].subblocks, entries[i].chunk_checksums, entries[i].voxels}) {
      EXPECT_EQ(section.offset % 64, 0u);
      EXPECT_GE(section.offset, end);
      end = section.offset + section.bytes;
    }
  }
  EXPECT_EQ(end, whole.size());
}

}  // namespace
}  // namespace blockwalk::volume_test
