// SPDX-License-Identifier: Apache-2.0
// A volume of 512^3 voxels and 64 subblocks a level, and plans of its views.
#pragma once

#include "renderer/plan/plan.h"

namespace blockwalk {

inline VolumeInfo volumeOf(VoxelType type, float density_min, float density_max) {
  VolumeInfo info;
  info.type = type;
  info.dims = {512, 512, 512};
  info.channels[0].density_min = density_min;
  info.channels[0].density_max = density_max;
  info.channels[0].histogram_hi = 255;
  info.channels[0].bin_cuts = {32, 64, 96, 128, 160, 192, 224};
  info.channels[0].nonempty_voxels = 64 * 512;
  for (int level = 0; level < levelCount(info.dims, info.blockVoxels()); ++level) {
    info.levels.push_back(
        {.dims = levelDims(info.dims, level), .block_count = 8, .subblock_count = 64, .voxel_bytes = 0});
  }
  return info;
}

inline Plan planFor(const View& view, const VolumeInfo& info, const DeviceTraits& device = {}) {
  return plan(resolveView(view, info), info, device, false, false);
}

}  // namespace blockwalk
