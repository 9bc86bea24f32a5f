// SPDX-License-Identifier: Apache-2.0
// The first pass: rows of the source become subblocks of level 0 in a spill, one record each, and statistics.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>

#include "volume/build_budget.h"
#include "volume/build_sort.h"
#include "volume/build_statistics.h"
#include "volume/build_storage.h"

namespace blockwalk {

// What a pass over the source leaves behind.
struct Scan {
  std::optional<float> threshold;  // where it was known before reading
  DensityStatistics statistics;
  RecordSorter records;  // finished
  TempBytes spill;       // subblocks, slot after slot
};

// Reads the whole source. Subblocks without a non-empty voxel are left out as far as the threshold is known; where it
// is not, those of a single value are records without a slot. `info` holds type, dims and sides.
Scan scanSource(Source& source, const VolumeInfo& info, const BuildOptions& options, const BuildBudget& budget,
                const std::filesystem::path& folder);

// Voxels of the subblock whose first voxel is `begin` that lie inside `dims`, an axis each.
glm::ivec3 insideExtent(glm::ivec3 begin, glm::ivec3 dims, int side);

// The key of a level-0 subblock; its block's origin and local index.
std::uint64_t subblockKey(glm::ivec3 subblock, int block_side);

}  // namespace blockwalk
