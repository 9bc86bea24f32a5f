// SPDX-License-Identifier: Apache-2.0
// Where a source that says where it is blank may not be: found from large boxes to small ones, so that blank space
// costs next to nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "volume/build/values_guess.h"
#include "volume/source.h"
#include "volume/volume.h"

namespace blockwalk {

inline std::uint64_t rowCount(const VoxelBox& box) {
  return static_cast<std::uint64_t>(box.dims().y) * static_cast<std::uint64_t>(box.dims().z);
}

// What is asked where something may be: Source::findRuns(), of one source or of several together.
using FindRuns = std::function<void(const VoxelBox& box, std::vector<VoxelRun>& runs)>;

// A box that is blank, or one row of blocks that may not be and the runs of x where: whole subblocks.
struct BlockRow {
  VoxelBox box;
  std::vector<VoxelRun> runs;  // none: blank
};

// All of the volume in rows of blocks and larger boxes that are blank, slabs of blocks going forward.
void forEachBlockRow(const VolumeInfo& info, const FindRuns& find, const std::function<void(const BlockRow&)>& visit);

// What of the row of blocks may not be blank, in bars of one row of subblocks: whole subblocks but at the faces of the
// volume, of about `bar_bytes` at most. A bar that goes on in another ends where the guess of values counts no pair.
void forEachBar(const VolumeInfo& info, const FindRuns& find, const BlockRow& row, std::size_t bar_bytes,
                const std::function<void(const VoxelBox&)>& visit);

// Whether the source's blank voxel is empty in every channel. `thresholds`: by channel; one that is not known may yet
// make it so.
bool isBlankEmpty(const SourceInfo& source, std::span<const std::optional<float>> thresholds);

}  // namespace blockwalk
