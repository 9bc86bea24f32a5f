// SPDX-License-Identifier: Apache-2.0
// Hierarchical Z order (Pascucci and Frank 2001): first what a subsampling by the greatest step keeps, then what one by
// half of it adds, and so on; inside each in the order of the codes, whose bits are those of x, y and z interleaved.
#pragma once

#include <bit>
#include <cstdint>
#include <glm/glm.hpp>

#include "volume/volume.h"

namespace blockwalk {

// Where the voxel of a code of `code_bits` bits lies, 0..2^code_bits - 1. Codes with the same number of zeros at their
// end, of which those of an aligned smaller box are a run, lie one after the other.
inline std::uint64_t hzFromCode(std::uint64_t code, int code_bits) {
  const std::uint64_t marked = code | std::uint64_t{1} << code_bits;
  return marked >> std::countr_zero(marked) >> 1;
}

// 2^bits is `side`, or the first that is not below it.
inline int sideBits(int side) {
  int bits = 0;
  while (1 << bits < side) ++bits;
  return bits;
}

// In a cube of side 2^bits, by Morton code: x lowest.
inline std::uint64_t hzFromMorton(std::uint64_t code, int bits) { return hzFromCode(code, 3 * bits); }

inline std::uint64_t hzAddress(glm::uvec3 position, int bits) { return hzFromMorton(mortonCode(position), bits); }

}  // namespace blockwalk
