// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/density_scale.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace blockwalk {

int densityExponent(const VolumeInfo& info, std::size_t number) {
  const ChannelInfo& channel = info.channels[number];
  constexpr int kUsual = 40;
  if (info.type != VoxelType::f32) return 0;
  const float largest = std::max(
      {std::abs(channel.density_min), std::abs(channel.density_max), std::abs(emptyValue(info.type, channel))});
  if (largest == 0) return 0;
  int exponent = 0;
  std::frexp(largest, &exponent);
  return std::abs(exponent) <= kUsual ? 0 : -exponent;
}

float onDevice(float stored, int exponent) { return std::ldexp(stored, exponent); }

void toDevice(std::span<std::byte> voxels, int exponent) {
  if (exponent == 0) return;
  for (std::size_t at = 0; at + sizeof(float) <= voxels.size(); at += sizeof(float)) {
    float density = 0;
    std::memcpy(&density, voxels.data() + at, sizeof density);
    density = onDevice(density, exponent);
    std::memcpy(voxels.data() + at, &density, sizeof density);
  }
}

StoredRange onDevice(StoredRange range, const VolumeInfo& info, std::size_t number) {
  constexpr float kLargest = std::numeric_limits<float>::max();
  constexpr float kLeastNormal = std::numeric_limits<float>::min();
  const int exponent = densityExponent(info, number);
  const float empty_threshold = info.channels[number].empty_threshold;
  // The largest float stands for no bound and must keep infinity out.
  StoredRange result{.lo = onDevice(range.lo, exponent),
                     .hi = std::min(range.hi < kLargest ? onDevice(range.hi, exponent) : kLargest, kLargest)};
  if (exponent != 0 && range.lo == std::nextafter(empty_threshold, kLargest)) {
    result.lo = std::nextafter(onDevice(empty_threshold, exponent), kLargest);
  }
  if (range.lo > 0) result.lo = std::max(result.lo, kLeastNormal);
  return result;
}

}  // namespace blockwalk
