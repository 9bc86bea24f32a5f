// SPDX-License-Identifier: Apache-2.0
// Tapered tubes, found by row: what vessels and wires are drawn with.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace blockwalk {

// A tube from a to b with round ends, its radius going evenly from radius_a to radius_b.
struct Capsule {
  glm::dvec3 a{0};
  glm::dvec3 b{0};
  double radius_a = 0;
  double radius_b = 0;
};

// Distance of a point from the capsule's axis, over the radius there: below 1 inside. `along` is 0 at a and 1 at b.
struct CapsuleHit {
  double distance = 0;
  double along = 0;
};
CapsuleHit locateInCapsule(const Capsule& capsule, glm::dvec3 point);

// Indices of the capsules that come near a row of constant (y, z), by bins of rows.
class CapsuleIndex {
 public:
  // `height` and `depth` bound y and z from above (both start at 0); capsules outside are never asked for.
  CapsuleIndex(std::span<const Capsule> capsules, double height, double depth);
  std::span<const std::uint32_t> near(double y, double z) const;

 private:
  std::size_t bin(double y, double z) const;
  int rows_ = 1;
  int layers_ = 1;
  double bin_side_ = 1;
  std::vector<std::vector<std::uint32_t>> bins_;
};

}  // namespace blockwalk
