// SPDX-License-Identifier: Apache-2.0
#include "volume/import/idx/idx_bits.h"

#include <bit>

namespace blockwalk {

std::uint64_t IdxBits::code(glm::ivec3 position) const {
  std::uint64_t code = 0;
  for (int i = 0; i < count(); ++i) {
    int& coordinate = position[axes[static_cast<std::size_t>(i)]];
    code |= static_cast<std::uint64_t>(coordinate & 1) << i;
    coordinate >>= 1;
  }
  return code;
}

glm::ivec3 IdxBits::position(std::uint64_t code, int begin, int end) const {
  glm::ivec3 position{0};
  glm::ivec3 bit{1};
  for (int i = begin; i < end; ++i) {
    const int axis = axes[static_cast<std::size_t>(i)];
    if ((code >> i & 1) != 0) position[axis] |= bit[axis];
    bit[axis] <<= 1;
  }
  return position;
}

glm::ivec3 IdxBits::extent(int begin, int end) const {
  glm::ivec3 extent{1};
  for (int i = begin; i < end; ++i) extent[axes[static_cast<std::size_t>(i)]] *= 2;
  return extent;
}

std::uint64_t IdxBits::codeAt(std::uint64_t address) const {
  const std::uint64_t marked = address << 1 | 1;
  const std::uint64_t top = std::uint64_t{1} << count();
  return (marked << (count() + 1 - std::bit_width(marked))) ^ top;
}

}  // namespace blockwalk
