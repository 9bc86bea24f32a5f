// SPDX-License-Identifier: Apache-2.0
// The first pass: rows of the source become subblocks of level 0 in a spill, one record each, and statistics.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "volume/build/budget.h"
#include "volume/build/sort.h"
#include "volume/build/spill.h"
#include "volume/build/statistics.h"
#include "volume/build/storage.h"
#include "volume/build/values_guess.h"
#include "volume/build/workers.h"

namespace blockwalk {

// What a pass over the source leaves behind.
struct Scan {
  std::vector<std::optional<float>> thresholds;  // by channel: where it was known before reading
  std::vector<DensityStatistics> statistics;     // by channel
  std::vector<ValuesGuess> guesses;              // by channel; none where nothing is guessed
  std::vector<ConversionReport> conversions;     // by channel
  RecordSorter records;                          // finished
  std::unique_ptr<Spill> spill;                  // subblocks, slot after slot; in a slot channel after channel
  TempBytes constants;                           // a voxel of each channel, for records of a single value
};

// Reads the whole source, but for what it says to be blank where that is empty. Subblocks without a non-empty voxel in
// any channel are left out where all thresholds are known; where one is not, those of a single value in each channel
// are records without a slot. `info` holds type, dims and sides, and for each channel its value map.
Scan scanSource(Source& source, const VolumeInfo& info, const BuildOptions& options, const BuildBudget& budget,
                const std::filesystem::path& folder, Workers& workers);

// Voxels of the subblock whose first voxel is `begin` that lie inside `dims`, an axis each.
glm::ivec3 insideExtent(glm::ivec3 begin, glm::ivec3 dims, int side);

// The key of a level-0 subblock; its block's origin and local index.
std::uint64_t subblockKey(glm::ivec3 subblock, int block_side);

}  // namespace blockwalk
