// SPDX-License-Identifier: Apache-2.0
#include "volume/import/geometry.h"

#include <cmath>

#include "volume/error.h"
#include "volume/volume.h"

namespace blockwalk {

glm::dmat4 worldFromIndex(const Geometry& geometry, const std::optional<glm::dvec3>& spacing, const std::string& source,
                          const std::string& field) {
  std::array<glm::dvec3, 3> axes = geometry.axes;
  double volume_of_units = 1;
  for (int i = 0; i < 3; ++i) {
    const double length = glm::length(axes[static_cast<std::size_t>(i)]);
    if (!std::isfinite(length) || !(length > 0)) {
      failData("{}: {}: the step along axis {} has length {}, it must be finite and above 0", source, field, i, length);
    }
    volume_of_units *= length;
  }
  // Relative to the lengths, so that micrometres and metres are judged alike.
  const double determinant = glm::dot(glm::cross(axes[0], axes[1]), axes[2]);
  if (!(std::fabs(determinant) > 1e-9 * volume_of_units)) {
    failData("{}: {}: the three axes lie in one plane", source, field);
  }
  if (spacing) {
    for (int i = 0; i < 3; ++i) {
      const double length = (*spacing)[i];
      if (!std::isfinite(length) || !(length > 0)) {
        failData("{}: spacing: {} along axis {} must be finite and above 0", source, length, i);
      }
      axes[static_cast<std::size_t>(i)] = glm::normalize(axes[static_cast<std::size_t>(i)]) * length;
    }
  }
  glm::dvec3 corner{0};
  if (geometry.first_center) {
    const glm::dvec3 half = 0.5 * (axes[0] + axes[1] + axes[2]);
    corner = *geometry.first_center - half;
    const glm::dvec3 rounding = 1e-15 * (glm::abs(*geometry.first_center) + glm::abs(half));
    const glm::dvec3 exact = geometry.corner.value_or(corner);
    if (glm::all(glm::lessThanEqual(glm::abs(exact - corner), rounding))) corner = exact;
  }
  for (int i = 0; i < 3; ++i) {
    if (!std::isfinite(corner[i])) failData("{}: {}: the origin {} is not finite", source, field, corner[i]);
  }
  return glm::dmat4(glm::dvec4(axes[0], 0), glm::dvec4(axes[1], 0), glm::dvec4(axes[2], 0), glm::dvec4(corner, 1));
}

glm::ivec3 checkedDims(std::int64_t x, std::int64_t y, std::int64_t z, const std::string& source,
                       const std::string& field) {
  for (const std::int64_t side : {x, y, z}) {
    if (side < 1 || side > kMaxDim) failData("{}: {}: {} is outside 1..{}", source, field, side, kMaxDim);
  }
  return {static_cast<int>(x), static_cast<int>(y), static_cast<int>(z)};
}

}  // namespace blockwalk
