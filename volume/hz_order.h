// SPDX-License-Identifier: Apache-2.0
// Hierarchical Z order of a cube of side 2^bits (Pascucci and Frank 2001): first what a subsampling by 2^bits keeps,
// then what one by half of that adds, and so on; inside each in Morton order, x lowest.
#pragma once

#include <bit>
#include <cstdint>
#include <glm/glm.hpp>

#include "volume/volume.h"

namespace blockwalk {

// Where the voxel of this Morton code lies, 0..8^bits - 1. Codes with the same number of trailing zeros, of which
// those of an aligned smaller cube are a run, lie one after the other.
inline std::uint64_t hzFromMorton(std::uint64_t code, int bits) {
  const std::uint64_t marked = code | std::uint64_t{1} << (3 * bits);
  return marked >> std::countr_zero(marked) >> 1;
}

inline std::uint64_t hzAddress(glm::uvec3 position, int bits) { return hzFromMorton(mortonCode(position), bits); }

}  // namespace blockwalk
