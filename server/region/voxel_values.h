// SPDX-License-Identifier: Apache-2.0
// What a voxel of level 0 holds, from the volume's file.
#pragma once

#include <exception>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "server/region/block_cache.h"
#include "server/region/served_step.h"

namespace blockwalk {

struct VoxelOrder {
  ServedFile served;
  int step = 0;
  glm::ivec3 voxel{0};  // inside the volume
};

struct VoxelValues {
  std::vector<std::optional<double>> values;  // one a channel, data units; none where the channel is empty there
  std::exception_ptr error;                   // as OpenedRegion's
};

// Reads a block a channel. `blocks` outlives it.
VoxelValues readVoxel(const VoxelOrder& order, BlockCache& blocks) noexcept;

}  // namespace blockwalk
