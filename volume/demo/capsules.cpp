// SPDX-License-Identifier: Apache-2.0
#include "volume/demo/capsules.h"

#include <algorithm>
#include <cmath>

namespace blockwalk {

CapsuleHit locateInCapsule(const Capsule& capsule, glm::dvec3 point) {
  const glm::dvec3 axis = capsule.b - capsule.a;
  const double length2 = glm::dot(axis, axis);
  const double t = length2 > 0 ? glm::dot(point - capsule.a, axis) / length2 : 0;
  const double along = std::min(std::max(t, 0.0), 1.0);
  const double radius = capsule.radius_a + (capsule.radius_b - capsule.radius_a) * along;
  return {glm::length(point - capsule.a - axis * along) / radius, along};
}

CapsuleIndex::CapsuleIndex(std::span<const Capsule> capsules, double height, double depth) {
  constexpr int kBins = 64;  // along the longer of the two
  bin_side_ = std::max(height, depth) / kBins;
  rows_ = static_cast<int>(height / bin_side_) + 1;
  layers_ = static_cast<int>(depth / bin_side_) + 1;
  bins_.resize(static_cast<std::size_t>(rows_) * static_cast<std::size_t>(layers_));
  for (std::uint32_t i = 0; i < capsules.size(); ++i) {
    const Capsule& capsule = capsules[i];
    const double radius = std::max(capsule.radius_a, capsule.radius_b);
    const glm::dvec3 low = (glm::min(capsule.a, capsule.b) - radius) / bin_side_;
    const glm::dvec3 high = (glm::max(capsule.a, capsule.b) + radius) / bin_side_;
    for (int z = std::max(0, static_cast<int>(std::floor(low.z))); z < layers_ && z <= high.z; ++z) {
      for (int y = std::max(0, static_cast<int>(std::floor(low.y))); y < rows_ && y <= high.y; ++y) {
        bins_[bin((y + 0.5) * bin_side_, (z + 0.5) * bin_side_)].push_back(i);
      }
    }
  }
}

std::size_t CapsuleIndex::bin(double y, double z) const {
  const int row = std::min(static_cast<int>(y / bin_side_), rows_ - 1);
  const int layer = std::min(static_cast<int>(z / bin_side_), layers_ - 1);
  return static_cast<std::size_t>(layer) * static_cast<std::size_t>(rows_) + static_cast<std::size_t>(row);
}

std::span<const std::uint32_t> CapsuleIndex::near(double y, double z) const { return bins_[bin(y, z)]; }

}  // namespace blockwalk
