// SPDX-License-Identifier: Apache-2.0
// Where a volume holds something is told when it is opened.
#include "volume/file/nonempty_box.h"

#include <gtest/gtest.h>

#include "tests/volume/file/file_contents.h"
#include "tests/volume/file/seal.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"
#include "volume/build/steps_builder.h"

namespace blockwalk::volume_test {
namespace {

const BuildOptions kSmall{.subblock_side = 4, .block_side = 2};

MemorySource oneVoxel(glm::ivec3 dims, glm::ivec3 at) {
  MemorySource source(VoxelType::u8, dims);
  source.set<std::uint8_t>(at, 200);
  return source;
}

// The stored subblocks' box, voxel by voxel.
VoxelBox storedBox(const VolumeFile& file) {
  const DenseLevel dense = readDense(file, 0);
  const glm::ivec3 dims = file.info().dims;
  VoxelBox box;
  for (int i = 0; i < dims.x * dims.y * dims.z; ++i) {
    const glm::ivec3 p(i % dims.x, i / dims.x % dims.y, i / dims.x / dims.y);
    if (dense.stored[static_cast<std::size_t>(i)]) box.include({.begin = p, .end = p + 1});
  }
  return box;
}

TEST(NonemptyBox, IsThatOfTheStoredSubblocks) {
  const ScratchFolder folder;
  MemorySource corner = oneVoxel({70, 41, 23}, {69, 5, 22});
  buildVolume(corner, folder / "corner.bwv", kSmall);
  EXPECT_EQ(VolumeFile(folder / "corner.bwv").info().nonempty, (VoxelBox{{68, 4, 20}, {70, 8, 23}}));
  for (const VoxelType type : {VoxelType::rgba8, VoxelType::u8, VoxelType::u16, VoxelType::f32}) {
    const std::size_t channels = type == VoxelType::u16 ? 2 : 1;
    MemorySource source = randomSource(type, {61, 47, 53}, 3, false, channels);
    for (std::size_t channel = 0; channel < channels && channels > 1; ++channel) {
      source.change().channels[channel].name = std::string(1, static_cast<char>('a' + channel));
    }
    buildVolume(source, folder / "random.bwv", kSmall);
    const VolumeFile file(folder / "random.bwv");
    EXPECT_EQ(file.info().nonempty, storedBox(file));
    EXPECT_EQ(nonemptyBox(file.info()), file.info().nonempty);
  }
}

TEST(NonemptyBox, OfAnEmptyVolumeIsNone) {
  const ScratchFolder folder;
  MemorySource source(VoxelType::u8, {20, 10, 5});
  buildVolume(source, folder / "empty.bwv", kSmall);
  const VolumeFile file(folder / "empty.bwv");
  EXPECT_TRUE(file.info().nonempty.isEmpty());
  EXPECT_EQ(nonemptyBox(file.info()), (VoxelBox{{0, 0, 0}, {20, 10, 5}}));
}

// A single voxel is nothing in a mean of many; of maxima it stays.
TEST(NonemptyBox, OfACoarserLevelHoldsWhatIsThin) {
  const ScratchFolder folder;
  MemorySource source(VoxelType::u8, {256, 200, 180});
  source.set<std::uint8_t>({201, 33, 150}, 1);
  buildVolume(source, folder / "thin.bwv", kSmall);
  const std::string bytes = readBytes(folder / "thin.bwv");
  const auto read = [&bytes](std::uint64_t offset, std::span<std::byte> out) {
    std::memcpy(out.data(), bytes.data() + offset, out.size());
  };
  const DecodedHeader header = decodeHeader(
      std::as_bytes(std::span(bytes)).first(valueAt<FileHeader>(bytes, 0).header_bytes), bytes.size(), "thin.bwv");
  const auto boxAt = [&](std::uint64_t most_bytes) {
    const EntryPlace entry = boxEntry(header, most_bytes);
    const std::size_t index = entryIndex(header.info, entry.level, entry.form);
    const std::string name = "thin.bwv";
    const RecordPlace place{.file = name,
                            .name = "level",
                            .entry = header.layout.entries[index],
                            .sections = header.layout.of(index, 0),
                            .info = header.info.level(entry.level, entry.form)};
    return std::pair(entry, boxOfRecords(place, entry.level, header.info, read));
  };
  const auto [finest, exact] = boxAt(kBoxRecordBytes);
  EXPECT_EQ(finest.level, 0);
  EXPECT_EQ(exact, (VoxelBox{{200, 32, 148}, {204, 36, 152}}));
  EXPECT_EQ(exact, VolumeFile(folder / "thin.bwv").info().nonempty);
  const auto [coarsest, around] = boxAt(0);
  EXPECT_EQ(coarsest.level, static_cast<int>(header.info.levels.size()) - 1);
  EXPECT_EQ(coarsest.form, Form::maxima);
  ASSERT_FALSE(around.isEmpty());
  VoxelBox both = around;
  both.include(exact);
  EXPECT_EQ(both, around);
  EXPECT_LE(around.end.x, 256);
}

// Level 1 has means alone, in which what is thin is lost: it is passed over.
TEST(NonemptyBox, IsNotOfMeansWhereThereAreMaxima) {
  DecodedHeader header;
  header.info.levels.resize(4);
  header.info.maxima.resize(2);
  header.layout.entries.resize(6);
  for (std::size_t i = 0; i < 6; ++i) header.layout.entries[i].blocks.bytes = 1000;
  header.layout.entries[1].blocks.bytes = 10;
  header.layout.entries[2].blocks.bytes = 10;
  header.layout.entries[5].blocks.bytes = 10;
  const EntryPlace place = boxEntry(header, 100);
  EXPECT_EQ(place.level, 3);
  EXPECT_EQ(place.form, Form::maxima);
  header.info.maxima.clear();  // labels
  EXPECT_EQ(boxEntry(header, 100).level, 1);
  EXPECT_EQ(boxEntry(header, 100).form, Form::values);
}

TEST(NonemptyBox, OfStepsIsOfAllOfThem) {
  const ScratchFolder folder;
  std::vector<MemorySource> steps;
  steps.push_back(oneVoxel({41, 23, 19}, {1, 1, 1}));
  steps.push_back(MemorySource(VoxelType::u8, {41, 23, 19}));
  steps.push_back(oneVoxel({41, 23, 19}, {30, 9, 18}));
  StepsBuilder builder(folder / "steps.bwv", 3);
  for (MemorySource& step : steps) builder.add(step, kSmall);
  builder.finish();
  const VolumeFile file(folder / "steps.bwv");
  EXPECT_EQ(file.info().nonempty, (VoxelBox{{0, 0, 0}, {32, 12, 19}}));
  for (int step = 0; step < 3; ++step) EXPECT_EQ(file.atStep(step).info().nonempty, file.info().nonempty);
}

// What is wrong is told to who reads it, as ever.
TEST(NonemptyBox, OfBrokenRecordsIsTheWhole) {
  const ScratchFolder folder;
  MemorySource source = oneVoxel({70, 41, 23}, {69, 5, 22});
  buildVolume(source, folder / "broken.bwv", kSmall);
  std::string bytes = readBytes(folder / "broken.bwv");
  const auto entry = valueAt<LevelEntry>(bytes, levelEntryAt(0));
  bytes[entry.blocks.offset] = static_cast<char>(bytes[entry.blocks.offset] ^ 1);
  writeBytes(folder / "broken.bwv", bytes);
  const VolumeFile file(folder / "broken.bwv");
  EXPECT_EQ(file.info().nonempty, (VoxelBox{{0, 0, 0}, {70, 41, 23}}));
  EXPECT_THROW(file.readLevel(0, 0), DataError);
}

}  // namespace
}  // namespace blockwalk::volume_test
