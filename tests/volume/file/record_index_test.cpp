// SPDX-License-Identifier: Apache-2.0
// What a file says of where its records lie: true, enough to read a window by, and never believed without a look.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "tests/volume/file/file_contents.h"
#include "tests/volume/file/seal.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"
#include "volume/error.h"
#include "volume/file/check.h"
#include "volume/file/file.h"

namespace blockwalk::volume_test {
namespace {

using ::testing::HasSubstr;

constexpr BlockWindow kWindow{.begin = {4, 5, 6}, .end = {9, 9, 9}};

// Of some thousand blocks of 4 voxels.
std::filesystem::path sparseFile(const ScratchFolder& folder, std::size_t channels = 1) {
  MemorySource source(VoxelType::u8, {70, 66, 62}, channels);
  std::mt19937 random(5);
  for (std::byte& voxel : source.voxels) {
    if (random() % 40 == 0) voxel = static_cast<std::byte>(1 + random() % 255);
  }
  std::filesystem::path path = folder / "sparse.bwv";
  buildVolume(source, path, {.subblock_side = 4, .block_side = 1});
  return path;
}

DecodedHeader headerOf(const std::string& bytes) {
  const auto all = std::as_bytes(std::span(bytes));
  return decodeHeader(all.first(headerBytes(all, bytes.size(), "a.bwv")), bytes.size(), "a.bwv");
}

// The same file as it was before there were indices.
std::string withoutIndex(const std::string& bytes) {
  const DecodedHeader from = headerOf(bytes);
  const auto metadata = valueAt<FileHeader>(bytes, 0).metadata_bytes;
  FileSizes sizes{.blocks = {}, .voxels = {}, .metadata = metadata};
  for (const LevelEntry& entry : from.layout.entries) sizes.blocks.push_back(entry.blocks.bytes);
  for (const ChannelSections& sections : from.layout.sections) sizes.voxels.push_back(sections.voxels.bytes);
  FileLayout layout = layOutFile(from.info, sizes);
  std::string out(layout.file_bytes, '\0');
  const auto move = [&](const Section& old, Section& section) {
    EXPECT_EQ(old.bytes, section.bytes);
    section.checksum = old.checksum;
    out.replace(section.offset, section.bytes, bytes, old.offset, old.bytes);
  };
  for (std::size_t i = 0; i < layout.entries.size(); ++i) {
    move(from.layout.entries[i].blocks, layout.entries[i].blocks);
  }
  for (std::size_t i = 0; i < layout.sections.size(); ++i) {
    const ChannelSections& old = from.layout.sections[i];
    move(old.ranges, layout.sections[i].ranges);
    move(old.apron_ranges, layout.sections[i].apron_ranges);
    move(old.pages, layout.sections[i].pages);
    move(old.voxels, layout.sections[i].voxels);
  }
  const std::vector<std::byte> header = encodeHeader(from.info, layout, bytes.substr(metadataAt(bytes), metadata));
  std::memcpy(out.data(), header.data(), header.size());
  return out;
}

// Records and voxels of the window in every channel.
std::vector<std::byte> contentOf(const VolumeFile& file, const BlockWindow& window) {
  std::vector<std::byte> content;
  const auto add = [&](const auto& value) {
    const auto bytes = std::as_bytes(std::span(&value, 1));
    content.insert(content.end(), bytes.begin(), bytes.end());
  };
  const auto addRecords = [&](const Level& level) {
    for (const Block& block : level.blocks) {
      add(block.origin);
      add(block.occupancy);
      add(block.first_stored);
      add(block.neighbours);
    }
    for (const Subblock& subblock : level.subblocks) {
      add(subblock.density_min);
      add(subblock.density_max);
      add(subblock.range_mask);
    }
  };
  for (int channel = 0; channel < static_cast<int>(file.info().channels.size()); ++channel) {
    const Level level = file.readLevel(0, channel, Form::values, window);
    addRecords(level);
    addRecords(file.readApronLevel(0, channel, Form::values, window));
    for (const Block& block : level.blocks) {
      std::vector<std::byte> voxels(block.subblock_count * file.info().subblockVoxels());
      file.readVoxels(0, channel, block.first_stored, block.subblock_count, voxels);
      content.insert(content.end(), voxels.begin(), voxels.end());
    }
  }
  return content;
}

TEST(RecordIndex, IsThereForLevelsOfManyRecordsAndTrue) {
  const ScratchFolder folder;
  const std::filesystem::path path = sparseFile(folder, 2);
  const DecodedHeader header = headerOf(readBytes(path));
  int with = 0;
  int without = 0;
  for (std::size_t i = 0; i < header.layout.entries.size(); ++i) {
    const bool has = header.layout.indices[i].bytes > 0;
    EXPECT_EQ(has, header.layout.entries[i].apron_block_count > kGroupRecords);
    ++(has ? with : without);
  }
  EXPECT_GT(with, 0);
  EXPECT_GT(without, 0);
  EXPECT_EQ(checkFile(VolumeFile(path), {}).faults, 0u);
}

TEST(RecordIndex, AFileOfFewRecordsHasNone) {
  const ScratchFolder folder;
  MemorySource source(VoxelType::u8, {32, 8, 8});
  source.set<std::uint8_t>({2, 2, 2}, 9);
  buildVolume(source, folder / "few.bwv", {});
  EXPECT_EQ(valueAt<FileHeader>(readBytes(folder / "few.bwv"), 0).group_records, 0u);
}

TEST(RecordIndex, AWindowIsReadWithoutALookAtAllRecords) {
  const ScratchFolder folder;
  const std::filesystem::path path = sparseFile(folder);
  const std::string bytes = readBytes(path);
  writeBytes(folder / "old.bwv", withoutIndex(bytes));
  const auto readBy = [](const VolumeFile& file) {
    const std::uint64_t before = file.bytesRead();
    (void)file.readApronLevel(0, 0, Form::values, kWindow);
    return file.bytesRead() - before;
  };
  const VolumeFile file(path);
  const std::uint64_t first = readBy(file);
  EXPECT_LT(first, readBy(VolumeFile(folder / "old.bwv")) / 2);
  EXPECT_EQ(readBy(file) + headerOf(bytes).layout.indices[0].bytes, first) << "again: its groups alone";
}

TEST(RecordIndex, FilesWithoutOneAreReadAsTheyWere) {
  const ScratchFolder folder;
  const std::filesystem::path path = sparseFile(folder, 2);
  writeBytes(folder / "old.bwv", withoutIndex(readBytes(path)));
  const VolumeFile file(path);
  const VolumeFile old(folder / "old.bwv");
  EXPECT_LT(old.fileBytes(), file.fileBytes());
  EXPECT_EQ(checkFile(old, {}).faults, 0u);
  for (const BlockWindow& window : {BlockWindow{}, kWindow, BlockWindow{.begin = {0, 0, 0}, .end = {17, 2, 3}},
                                    BlockWindow{.begin = {3, 3, 3}, .end = {3, 9, 9}}}) {
    EXPECT_EQ(contentOf(file, window), contentOf(old, window));
  }
}

TEST(RecordIndex, CountsAreThoseOfTheRecords) {
  const ScratchFolder folder;
  const VolumeFile file(sparseFile(folder));
  std::mt19937 random(3);
  const auto place = [&] { return static_cast<int>(random() % 20) - 1; };
  std::uint64_t all = 0;
  for (int i = 0; i < 30; ++i) {
    const glm::ivec3 a(place(), place(), place());
    const glm::ivec3 b(place(), place(), place());
    const BlockWindow window = i == 0 ? BlockWindow{} : BlockWindow{.begin = glm::min(a, b), .end = glm::max(a, b) + 1};
    for (const bool with_apron : {false, true}) {
      const Level level =
          with_apron ? file.readApronLevel(0, 0, Form::values, window) : file.readLevel(0, 0, Form::values, window);
      const RecordCount count{.blocks = level.blocks.size(), .subblocks = level.subblocks.size()};
      EXPECT_EQ(file.countRecords(0, Form::values, with_apron, window), count);
      const RecordCount most = file.mostRecords(0, Form::values, with_apron, window);
      EXPECT_GE(most.blocks, count.blocks);
      EXPECT_GE(most.subblocks, count.subblocks);
      if (i == 0) {
        EXPECT_EQ(most, count);
      }
      all += count.blocks;
    }
  }
  EXPECT_GT(all, 10000u);
}

// Every word of the index changed, with checksums that are right: what is read of a window is right, or refused by
// name; and whoever checks the file always sees it.
TEST(RecordIndex, AFalseOneIsFound) {
  const ScratchFolder folder;
  const std::filesystem::path path = sparseFile(folder);
  const std::string whole = readBytes(path);
  const Section index = headerOf(whole).layout.indices[0];
  ASSERT_GT(index.bytes, 200u);
  const std::vector<std::byte> right = contentOf(VolumeFile(path), kWindow);
  int refused = 0;
  int unseen = 0;
  for (std::uint64_t at = 0; at + sizeof(std::uint64_t) < index.bytes; at += sizeof(std::uint64_t)) {
    for (const std::uint64_t change : {std::uint64_t{1}, std::uint64_t{1} << 63}) {
      std::string broken = whole;
      putAt(std::as_writable_bytes(std::span(broken)), index.offset + at,
            valueAt<std::uint64_t>(whole, index.offset + at) + change);
      seal(broken);
      writeBytes(folder / "broken.bwv", broken);
      const VolumeFile file(folder / "broken.bwv");
      try {
        EXPECT_EQ(contentOf(file, kWindow), right) << at;
        ++unseen;
      } catch (const DataError& error) {
        EXPECT_THAT(error.what(), HasSubstr("broken.bwv: level 0"));
        ++refused;
      }
      EXPECT_GE(checkFile(file, {}).faults, 1u) << at;
    }
  }
  EXPECT_GT(refused, unseen);
}

// A group's code moved to just before the next one's: windows of what it has would pass it by.
TEST(RecordIndex, AGroupThatSaysItBeginsLaterIsFound) {
  const ScratchFolder folder;
  const std::string whole = readBytes(sparseFile(folder));
  const DecodedHeader header = headerOf(whole);
  const Section index = header.layout.indices[0];
  const VolumeFile right(folder / "sparse.bwv");
  constexpr std::uint64_t kBytes = sizeof(IndexGroup) + sizeof(IndexPart);
  for (std::uint64_t group = 1; (group + 2) * kBytes < index.bytes; ++group) {
    const std::uint64_t at = index.offset + group * kBytes;
    const auto code = valueAt<std::uint64_t>(whole, at);
    std::string broken = whole;
    putAt(std::as_writable_bytes(std::span(broken)), at, valueAt<std::uint64_t>(whole, at + kBytes) - 1);
    seal(broken);
    writeBytes(folder / "broken.bwv", broken);
    const VolumeFile file(folder / "broken.bwv");
    const glm::ivec3 origin = mortonPosition(code);
    const BlockWindow window{.begin = origin, .end = origin + 1};
    ASSERT_GT(right.readApronLevel(0, 0, Form::values, window).blocks.size(), 0u);
    EXPECT_THROW((void)file.readApronLevel(0, 0, Form::values, window), DataError) << group;
    EXPECT_THROW((void)file.countRecords(0, Form::values, true, window), DataError) << group;
  }
}

TEST(RecordIndex, ALevelHasNoMoreBlocksThanRoomForThem) {
  const ScratchFolder folder;
  std::string bytes = readBytes(sparseFile(folder));
  const std::size_t at = levelEntryAt(entryCount(bytes) - 1);
  auto entry = valueAt<LevelEntry>(bytes, at);
  entry.apron_block_count = entry.apron_subblock_count = 1000;
  putAt(std::as_writable_bytes(std::span(bytes)), at, entry);
  sealHeader(bytes);
  writeBytes(folder / "broken.bwv", bytes);
  try {
    const VolumeFile file(folder / "broken.bwv");
    FAIL() << "was not refused";
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("apron_block_count"));
    EXPECT_THAT(error.what(), HasSubstr("which the level has room for"));
  }
}

// So many that their entries are not all looked at when the file is opened.
TEST(RecordIndex, PagesOfManyAreFoundByTheirGroups) {
  const ScratchFolder folder;
  constexpr int kSide = 256;
  MemorySource source(VoxelType::u8, glm::ivec3(kSide), 4);
  std::mt19937 random(4);
  for (std::byte& voxel : source.voxels) voxel = static_cast<std::byte>(random() % 251);
  buildVolume(source, folder / "many.bwv", {.subblock_side = 4, .block_side = 1});
  const std::string whole = readBytes(folder / "many.bwv");
  const DecodedHeader header = headerOf(whole);
  std::uint64_t pages = 0;
  for (const ChannelSections& sections : header.layout.sections) pages += sections.pages.bytes / sizeof(PageEntry);
  ASSERT_GT(pages, kMostCountedPages);
  const BlockWindow window{.begin = {30, 20, 10}, .end = {34, 25, 15}};
  const auto expectVoxels = [&](const VolumeFile& file) {
    for (int channel = 0; channel < 4; ++channel) {
      for (const Block& block : file.readLevel(0, channel, Form::values, window).blocks) {
        std::vector<std::byte> voxels(64);
        file.readVoxels(0, channel, block.first_stored, 1, voxels);
        for (std::size_t i = 0; i < voxels.size(); ++i) {
          const glm::ivec3 place = block.origin * 4 + glm::ivec3(i % 4, i / 4 % 4, i / 16);
          const auto at = static_cast<std::size_t>(place.x + kSide * (place.y + kSide * (place.z + kSide * channel)));
          ASSERT_EQ(voxels[i], source.voxels[at]);
        }
      }
    }
  };
  {
    const VolumeFile file(folder / "many.bwv");
    const std::uint64_t before = file.bytesRead();
    expectVoxels(file);
    EXPECT_LT(file.bytesRead() - before, header.layout.sections[0].pages.bytes) << "of one channel all entries";
  }
  // What it says of the pages of the groups that the window meets, of channel 2.
  const std::uint64_t group_bytes = sizeof(IndexGroup) + 4 * sizeof(IndexPart);
  const Section index = header.layout.indices[0];
  for (const std::size_t field : {offsetof(IndexPart, pages), offsetof(IndexPart, page_offset)}) {
    std::string broken = whole;
    for (std::uint64_t at = index.offset + group_bytes; at + group_bytes < index.offset + index.bytes;
         at += group_bytes) {
      const std::uint64_t word = at + sizeof(IndexGroup) + 2 * sizeof(IndexPart) + field;
      putAt(std::as_writable_bytes(std::span(broken)), word, valueAt<std::uint64_t>(whole, word) + 1);
    }
    seal(broken);
    writeBytes(folder / "broken.bwv", broken);
    const VolumeFile file(folder / "broken.bwv");
    EXPECT_THROW(expectVoxels(file), DataError) << field;
  }
}

TEST(RecordIndex, ABrokenOneIsRefusedByItsChecksum) {
  const ScratchFolder folder;
  std::string bytes = readBytes(sparseFile(folder));
  const Section index = headerOf(bytes).layout.indices[0];
  bytes[index.offset + 9] ^= 4;
  writeBytes(folder / "broken.bwv", bytes);
  const VolumeFile file(folder / "broken.bwv");
  try {
    (void)file.readLevel(0, 0, Form::values, kWindow);
    FAIL() << "was not refused";
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), HasSubstr("broken.bwv: level 0 index at offset " + std::to_string(index.offset)));
  }
  // All of the level has no need of it.
  EXPECT_GT(file.readLevel(0, 0).blocks.size(), 1000u);
}

}  // namespace
}  // namespace blockwalk::volume_test
