// SPDX-License-Identifier: Apache-2.0
#include "volume/build/budget.h"

#include <algorithm>
#include <utility>

#include "volume/build/workers.h"

namespace blockwalk {
namespace {

// Blocks, subblocks and strips that are in memory whatever the budget's parts are.
std::uint64_t fixedBytes(const VolumeInfo& grid, int workers) {
  const std::uint64_t side = static_cast<std::uint64_t>(grid.subblock_side);
  const std::uint64_t strip = static_cast<std::uint64_t>(grid.dims.x) *
                              std::min(side, static_cast<std::uint64_t>(grid.dims.y)) *
                              std::min(side, static_cast<std::uint64_t>(grid.dims.z)) * voxelBytes(grid.type);
  const std::uint64_t channels = grid.channels.size();
  const auto block_voxels = static_cast<std::uint64_t>(grid.blockVoxels());
  const std::uint64_t block = block_voxels * block_voxels * block_voxels * voxelBytes(grid.type);
  const auto levels = static_cast<std::uint64_t>(levelCount(grid.dims, grid.blockVoxels()));
  // Of each worker first the blocks that it looks at and what it finds, then the pages that it packs, packed ones, and
  // some that wait to be written.
  const std::uint64_t pages = std::max(block, std::uint64_t{1} << 20);
  const std::uint64_t waiting = (2 * static_cast<std::uint64_t>(workers) + 1) * 2;
  const std::uint64_t of_workers = waiting * std::max(channels * block + (std::uint64_t{1} << 20), pages);
  return channels * (2 * strip + (2 * levels + 1) * block) + of_workers + (std::uint64_t{8} << 20);
}

// The streams, the slab and the sort take up to about three fifths.
std::uint64_t withTheRest(std::uint64_t fixed_bytes) { return fixed_bytes / 2 * 5; }

}  // namespace

std::uint64_t leastMemoryBytes(const VolumeInfo& grid) {
  return std::max(kLeastMemoryBytes, withTheRest(fixedBytes(grid, 1)));
}

BuildBudget budgetOf(const VolumeInfo& grid, bool random_access, std::uint64_t memory_bytes, int processors) {
  BuildBudget budget = budgetOf(memory_bytes);
  budget.workers = workerCount(memory_bytes, processors);
  while (budget.workers > 1 && withTheRest(fixedBytes(grid, budget.workers)) > memory_bytes) --budget.workers;
  if (random_access) budget.spill_bytes += std::exchange(budget.slab_bytes, 0);
  budget.spill_bytes -= std::min(budget.spill_bytes, fixedBytes(grid, budget.workers));
  return budget;
}

}  // namespace blockwalk
