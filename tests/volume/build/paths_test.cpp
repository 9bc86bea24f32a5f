// SPDX-License-Identifier: Apache-2.0
// The same voxels give the same bytes, whichever way they went through memory and disk.
#include <gtest/gtest.h>

#include "tests/volume/memory_source.h"
#include "volume/build/budget.h"
#include "volume/build/sort.h"
#include "volume/error.h"

namespace blockwalk::volume_test {
namespace {

TEST(BuilderPaths, SlabsSortsAndStreamsDoNotShow) {
  const ScratchFolder folder;
  for (VoxelType type : {VoxelType::rgba8, VoxelType::u8, VoxelType::u16, VoxelType::f32}) {
    SCOPED_TRACE(voxelTypeName(type));
    const BuildOptions options{.subblock_side = 4, .block_side = 3};
    MemorySource source = randomSource(type, {61, 83, 39}, 21, true);
    buildVolume(source, folder / "random.bwv", options);
    const std::string expected = readBytes(folder / "random.bwv");
    ASSERT_GT(expected.size(), 10000u);

    source.change().random_access = false;
    buildVolume(source, folder / "slab.bwv", options);
    EXPECT_EQ(readBytes(folder / "slab.bwv"), expected) << "slab in memory";

    BuildBudget budget = budgetOf(options.memory_bytes);
    budget.workers = 2;
    budget.slab_bytes = 1000;
    buildVolume(source, folder / "disk.bwv", options, budget);
    EXPECT_EQ(readBytes(folder / "disk.bwv"), expected) << "slab on disk";

    buildVolume(source, folder / "tiny.bwv", options, {.slab_bytes = 1, .sort_bytes = 1, .stream_bytes = 100});
    EXPECT_EQ(readBytes(folder / "tiny.bwv"), expected) << "everything on disk";
    EXPECT_EQ(verifyVolume(source, folder / "tiny.bwv"), source.voxelCount());
  }
  // Temporary files have no names, finished ones have theirs.
  std::size_t names = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder.path)) ++names;
  EXPECT_EQ(names, 4u);
}

TEST(BuilderPaths, SorterMergesRuns) {
  const ScratchFolder folder;
  for (const int count : {0, 1, 15, 16, 17, 1000, 5000}) {
    RecordSorter sorter(folder.path, 64 * sizeof(SubblockRecord));
    for (int i = 0; i < count; ++i) {
      const std::uint64_t key = static_cast<std::uint64_t>(i) * 7919 % 5003;  // each key once
      sorter.add({.key = key, .slot = key * 3});
    }
    sorter.finish();
    EXPECT_EQ(sorter.runCount() > 1, count > 64);
    SubblockRecord record;
    std::uint64_t last = 0;
    int found = 0;
    while (sorter.next(record)) {
      ASSERT_TRUE(found == 0 || record.key > last);
      ASSERT_EQ(record.slot, record.key * 3);
      last = record.key;
      ++found;
    }
    EXPECT_EQ(found, count);
  }
}

TEST(BuilderPaths, TempBytesReadBackAcrossTheBuffer) {
  const ScratchFolder folder;
  for (const std::size_t buffer : {std::size_t{0}, std::size_t{7}, std::size_t{64}, std::size_t{100000}}) {
    TempBytes bytes(folder.path, buffer);
    std::vector<std::byte> expected;
    for (int round = 0; round < 2; ++round) {
      expected.clear();
      bytes.clear();
      for (int i = 0; i < 200; ++i) {
        const std::vector<std::byte> part(static_cast<std::size_t>(i * 13 % 97), static_cast<std::byte>(i + round));
        bytes.append(part);
        expected.insert(expected.end(), part.begin(), part.end());
        ASSERT_EQ(bytes.size(), expected.size());
      }
      for (std::size_t at = 0; at < expected.size(); at += 111) {
        std::vector<std::byte> out(std::min<std::size_t>(301, expected.size() - at));
        bytes.read(at, out);
        ASSERT_TRUE(std::equal(out.begin(), out.end(), expected.begin() + static_cast<std::ptrdiff_t>(at)));
      }
    }
  }
}

}  // namespace
}  // namespace blockwalk::volume_test
