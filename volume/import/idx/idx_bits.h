// SPDX-License-Identifier: Apache-2.0
// The order of bits of an OpenVisus volume, which is a volume's own: whose axis each bit of a code is.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace blockwalk {

struct IdxBits {
  std::vector<std::uint8_t> axes;  // of the code's bits, lowest first; 0 x, 1 y, 2 z

  int count() const { return static_cast<int>(axes.size()); }
  // The first, second and so on of an axis are the bits of its coordinate.
  std::uint64_t code(glm::ivec3 position) const;
  // Of the bits [begin, end) of a code, as if they were all: the coordinates that they make.
  glm::ivec3 position(std::uint64_t code, int begin, int end) const;
  glm::ivec3 position(std::uint64_t code) const { return position(code, 0, count()); }
  // Voxels along each axis that the bits [begin, end) tell from each other.
  glm::ivec3 extent(int begin, int end) const;
  // The code at an address of the hierarchical order: the way back of hzFromCode().
  std::uint64_t codeAt(std::uint64_t address) const;
};

}  // namespace blockwalk
