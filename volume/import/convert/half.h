// SPDX-License-Identifier: Apache-2.0
// 16-bit floats (IEEE 754 binary16): every one is a 32-bit float.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace blockwalk {

inline float floatFromHalf(std::uint16_t half) {
  const std::uint32_t sign = static_cast<std::uint32_t>(half & 0x8000) << 16;
  const std::uint32_t exponent = half >> 10 & 0x1f;
  const std::uint32_t fraction = half & 0x3ff;
  if (exponent == 0) {
    const float small = static_cast<float>(fraction) * 0x1p-24f;
    return sign != 0 ? -small : small;
  }
  const std::uint32_t biased = exponent == 0x1f ? 0xffu : exponent + 112;
  return std::bit_cast<float>(sign | biased << 23 | fraction << 13);
}

// This machine's floats of halves in either byte order.
inline std::vector<std::byte> floatsFromHalves(std::span<const std::byte> halves, bool swap_bytes) {
  std::vector<std::byte> floats(halves.size() / 2 * sizeof(float));
  for (std::size_t i = 0; i < halves.size() / 2; ++i) {
    std::uint16_t half = 0;
    std::memcpy(&half, &halves[2 * i], sizeof half);
    if (swap_bytes) half = static_cast<std::uint16_t>(half << 8 | half >> 8);
    const float value = floatFromHalf(half);
    std::memcpy(&floats[i * sizeof value], &value, sizeof value);
  }
  return floats;
}

}  // namespace blockwalk
