// SPDX-License-Identifier: Apache-2.0
// Memory decides how many workers there are, and never the other way round.
#include "volume/build/budget.h"

#include <gtest/gtest.h>

#include "volume/build/workers.h"

namespace blockwalk::volume_test {
namespace {

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;
constexpr std::uint64_t kGiB = std::uint64_t{1} << 30;

VolumeInfo gridOf(VoxelType type, glm::ivec3 dims, std::size_t channels, int subblock_side) {
  VolumeInfo grid;
  grid.type = type;
  grid.dims = dims;
  grid.subblock_side = subblock_side;
  grid.block_side = kMaxBlockSide;
  grid.channels.resize(channels);
  return grid;
}

TEST(BuildBudget, WorkersAreThoseOfTheProcessorsThatHaveMemory) {
  EXPECT_EQ(workerCount(2 * kGiB, 0), 1);
  EXPECT_EQ(workerCount(2 * kGiB, 1), 1);
  EXPECT_EQ(workerCount(2 * kGiB, 5), 5);
  EXPECT_EQ(workerCount(2 * kGiB, 1000), 8);
  EXPECT_EQ(workerCount(0, 5), 1);
  EXPECT_EQ(workerCount(64 * kMiB, 5), 1);
  EXPECT_EQ(workerCount(200 * kMiB, 5), 3);
}

TEST(BuildBudget, WhatIsEnoughOnOneProcessorIsEnoughOnMany) {
  const VolumeInfo grid = gridOf(VoxelType::f32, {9000, 300, 300}, 4, 16);
  const std::uint64_t least = leastMemoryBytes(grid);
  ASSERT_GT(least, 8 * 64 * kMiB) << "memory for eight workers, were it not for their blocks";
  for (const int processors : {1, 2, 8, 64}) {
    const BuildBudget budget = budgetOf(grid, true, least, processors);
    EXPECT_EQ(budget.workers, 1) << processors;
    EXPECT_GT(budget.spill_bytes, 0u) << processors;
  }
}

TEST(BuildBudget, MoreMemoryGivesNoFewerWorkers) {
  const VolumeInfo grid = gridOf(VoxelType::f32, {9000, 300, 300}, 4, 16);
  const std::uint64_t least = leastMemoryBytes(grid);
  int before = 1;
  for (std::uint64_t memory = least; memory <= 8 * least; memory += least / 16) {
    const int workers = budgetOf(grid, false, memory, 8).workers;
    EXPECT_GE(workers, before);
    EXPECT_LE(workers, before + 1);
    before = workers;
  }
  EXPECT_EQ(before, 8);
}

TEST(BuildBudget, OrdinaryVolumesHaveAWorkerEachProcessor) {
  for (const VoxelType type : {VoxelType::u8, VoxelType::rgba8, VoxelType::u16, VoxelType::f32}) {
    const VolumeInfo grid = gridOf(type, {1024, 1024, 1024}, 1, 8);
    EXPECT_LE(leastMemoryBytes(grid), 72 * kMiB) << voxelTypeName(type) << ": within 96 MiB less a decoder's quarter";
    EXPECT_EQ(budgetOf(grid, true, 2 * kGiB, 8).workers, 8) << voxelTypeName(type);
  }
}

TEST(BuildBudget, NoSlabIsKeptOfASourceWithRandomAccess) {
  const VolumeInfo grid = gridOf(VoxelType::u8, {512, 512, 512}, 1, 8);
  const BuildBudget in_order = budgetOf(grid, false, kGiB, 4);
  const BuildBudget random = budgetOf(grid, true, kGiB, 4);
  EXPECT_EQ(in_order.slab_bytes, kGiB / 3);
  EXPECT_EQ(random.slab_bytes, 0u);
  EXPECT_EQ(random.spill_bytes, in_order.spill_bytes + kGiB / 3);
}

}  // namespace
}  // namespace blockwalk::volume_test
