// SPDX-License-Identifier: Apache-2.0
// The second pass: records and coarser levels, built together from level 0's blocks in one walk along the Morton curve.
//
// The eight children of a coarse block follow each other on the curve, so a level holds one unfinished block at a time:
// it is finished when a child of another block arrives, and is then itself the next child of the level above.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include "volume/build_budget.h"
#include "volume/build_downsample.h"
#include "volume/build_scan.h"
#include "volume/build_storage.h"
#include "volume/build_summary.h"

namespace blockwalk {

// One finished level, as the file will hold it.
struct BuiltLevel {
  LevelInfo info;
  TempBytes blocks;     // block records
  TempBytes subblocks;  // subblock records
  TempBytes content;    // level 0: u64 slots in the spill; coarser: the voxels
};

class LevelBuilder {
 public:
  // `info` is complete but for the levels, histogram and nonempty_voxels, which this fills. Both outlive the builder.
  LevelBuilder(VolumeInfo& info, TempBytes& spill, const BuildBudget& budget, const std::filesystem::path& folder);

  struct Candidate {
    std::uint8_t local = 0;
    std::uint64_t slot = 0;  // level 0
    std::span<const std::byte> voxels;
  };
  // The candidates of one block of level 0, in ascending order of `local`; blocks in Morton order. Those without a
  // non-empty voxel are dropped.
  void add(glm::ivec3 origin, std::span<const Candidate> candidates) { push(0, origin, candidates); }
  // Finishes all levels and sets info.levels.
  std::vector<BuiltLevel> finish();

 private:
  struct Pending {
    bool any = false;
    glm::ivec3 origin{0};
    std::array<bool, kMaxBlockSide * kMaxBlockSide * kMaxBlockSide> touched{};
    std::vector<std::byte> voxels;  // block_side^3 subblocks
  };
  void push(std::size_t level, glm::ivec3 origin, std::span<const Candidate> candidates);
  void appendContent(std::size_t level, const Candidate& candidate);
  void averageInto(std::size_t level, glm::ivec3 subblock, glm::ivec3 extent, std::span<const std::byte> voxels);
  void finishPending(std::size_t level);
  glm::ivec3 localPosition(int local) const;

  VolumeInfo& info_;
  TempBytes& spill_;
  SubblockSummary summary_;
  Downsampler downsampler_;
  std::size_t subblock_bytes_;
  std::vector<BuiltLevel> levels_;
  std::vector<Pending> pending_;  // [0] is not used
  std::vector<std::byte> record_;
};

// Feeds the scan's records to a LevelBuilder, block by block.
std::vector<BuiltLevel> buildLevels(Scan& scan, VolumeInfo& info, const BuildBudget& budget,
                                    const std::filesystem::path& folder, const BuildOptions& options);

// Reads subblocks from the spill, one after the other into `out`; neighbours in the spill are read at once.
void loadSlots(const TempBytes& spill, std::span<const std::uint64_t> slots, std::span<std::byte> out);

}  // namespace blockwalk
