// SPDX-License-Identifier: Apache-2.0
// What reading records takes: nothing for each of those that are right.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/volume/allocations.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"
#include "volume/file/file.h"

namespace blockwalk::volume_test {
namespace {

// No text is made of a bound that holds.
TEST(Records, ThoseThatAreRightAllocateNothingEach) {
  const ScratchFolder folder;
  MemorySource source(VoxelType::u8, {64, 64, 64});
  std::ranges::fill(source.voxels, std::byte{7});
  buildVolume(source, folder / "full.bwv", {.subblock_side = 4, .block_side = 1});
  const std::uint64_t before = allocations().count;
  const VolumeFile file(folder / "full.bwv");
  const std::uint64_t opened = allocations().count;
  const Level level = file.readLevel(0, 0);
  const std::uint64_t read = allocations().count;
  const Level with_apron = file.readApronLevel(0, 0);
  const std::uint64_t read_apron = allocations().count;
  ASSERT_EQ(level.blocks.size(), 4096u);
  ASSERT_EQ(with_apron.blocks.size(), 4096u);
  EXPECT_LT(opened - before, 1024u) << "pages of all levels";
  EXPECT_LT(read - opened, 256u);
  EXPECT_LT(read_apron - read, 256u);
}

}  // namespace
}  // namespace blockwalk::volume_test
