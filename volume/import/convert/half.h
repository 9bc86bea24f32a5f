// SPDX-License-Identifier: Apache-2.0
// 16-bit floats (IEEE 754 binary16): every one is a 32-bit float.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

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

// The nearest; of two the even one.
inline std::uint16_t halfFromFloat(float value) {
  const auto sign = static_cast<std::uint16_t>(std::signbit(value) ? 0x8000 : 0);
  if (std::isnan(value)) return static_cast<std::uint16_t>(sign | 0x7e00);
  const float size = std::abs(value);
  if (size >= 65520) return static_cast<std::uint16_t>(sign | 0x7c00);  // beyond the largest and half a step
  // Steps between neighbours are 2^-24 up to 2^-14, and from there on 2^-10 of the power of two below. A step beyond
  // the largest fraction is the next power of two.
  const int exponent = std::max(size > 0 ? std::ilogb(size) : -14, -14);
  const auto steps = static_cast<std::uint32_t>(std::nearbyint(std::ldexp(size, 10 - exponent)));
  return static_cast<std::uint16_t>(sign | (steps + (static_cast<std::uint32_t>(exponent + 14) << 10)));
}

}  // namespace blockwalk
