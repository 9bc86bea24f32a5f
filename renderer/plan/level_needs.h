// SPDX-License-Identifier: Apache-2.0
// What a view of a level takes on the device, all channels of it together (docs/large.md).
#pragma once

#include <cstdint>

#include "volume/volume.h"

namespace blockwalk {

struct LevelNeeds {
  std::uint64_t nearest_bytes = 0;  // all voxels, without light
  std::uint64_t linear_bytes = 0;   // with what surrounds each subblock, as interpolation and light need them
  std::uint64_t record_bytes = 0;   // of blocks and subblocks, and the quarters of one range: all of them
};

// Of the volume its type, sides and number of channels are looked at, of the level its counts.
LevelNeeds levelNeeds(const VolumeInfo& info, const LevelInfo& level);

}  // namespace blockwalk
