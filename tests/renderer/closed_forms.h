// SPDX-License-Identifier: Apache-2.0
// What tests of the reference against closed forms have in common.
#pragma once

#include <glm/glm.hpp>

#include "tests/reference/analytic.h"
#include "tests/reference/reference.h"

namespace blockwalk::reference {

inline constexpr double kTolerance = 1e-12;

// Density z of the voxel's centre, at its centre: z from 0.5 to 7.5.
inline DenseVolume ramp8() { return sampled(rampField(0, {0, 0, 1}), VoxelType::f32, glm::ivec3(8)); }

// Of the one pixel of a view.
inline glm::dvec3 colorOf(const DenseVolume& volume, const View& view) {
  return glm::dvec3(renderPixel(volume, view, 0, 0).color);
}

inline double distance(glm::dvec3 a, glm::dvec3 b) { return glm::length(a - b); }

inline Pixel pixelOf(const DenseVolume& volume, const View& view) { return renderPixel(volume, view, 0, 0); }

// The lattice along z through a volume 8 deep seen from z = 24 has a point at z = 4: samples at 4 +- 1/4, 3/4, ...
inline View alongZ(double x, double y, Mode mode) {
  View view = linearView({x, y, 24}, {x, y, 0}, mode);
  view.up = glm::dvec3(0, 1, 0);
  return view;
}

}  // namespace blockwalk::reference
