// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "volume/volume.h"

namespace blockwalk {

// Voxels from `begin` up to and without `end`, on each axis.
struct VoxelBox {
  glm::ivec3 begin{0};
  glm::ivec3 end{0};

  glm::ivec3 dims() const { return end - begin; }
  std::uint64_t voxels() const { return cellCount(dims()); }
  bool operator==(const VoxelBox&) const = default;
};

}  // namespace blockwalk
