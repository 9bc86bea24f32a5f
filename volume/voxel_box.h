// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

namespace blockwalk {

// Voxels from `begin` up to and without `end`, on each axis.
struct VoxelBox {
  glm::ivec3 begin{0};
  glm::ivec3 end{0};

  glm::ivec3 dims() const { return end - begin; }
  std::uint64_t voxels() const {
    const glm::u64vec3 sides(dims());
    return sides.x * sides.y * sides.z;
  }
  bool isEmpty() const { return glm::any(glm::lessThanEqual(end, begin)); }
  // The least box that has both.
  void include(const VoxelBox& other) {
    if (other.isEmpty()) return;
    const bool was_empty = isEmpty();
    begin = was_empty ? other.begin : glm::min(begin, other.begin);
    end = was_empty ? other.end : glm::max(end, other.end);
  }
  bool operator==(const VoxelBox&) const = default;
};

}  // namespace blockwalk
