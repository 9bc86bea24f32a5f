// SPDX-License-Identifier: Apache-2.0
// Where a file's voxels lie in world space.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>

namespace blockwalk {

// axes[i] is the world step from one sample to the next along index axis i. `first_center` is the world position of the
// first sample's centre, which is index (0.5, 0.5, 0.5); without it index (0, 0, 0) lies at the world's origin.
// `corner` is where that index lies to the last digit: taken where `first_center` says the same but for rounding.
struct Geometry {
  std::array<glm::dvec3, 3> axes{glm::dvec3{1, 0, 0}, glm::dvec3{0, 1, 0}, glm::dvec3{0, 0, 1}};
  std::optional<glm::dvec3> first_center;
  std::optional<glm::dvec3> corner = std::nullopt;
};

// `spacing` replaces the lengths of the axes. Throws DataError, naming `source` and `field`, where the axes are not
// finite or do not span space.
glm::dmat4 worldFromIndex(const Geometry& geometry, const std::optional<glm::dvec3>& spacing, const std::string& source,
                          const std::string& field);

// Throws DataError, naming `source`, `field` and the bound, unless every side is 1..kMaxDim.
glm::ivec3 checkedDims(std::int64_t x, std::int64_t y, std::int64_t z, const std::string& source,
                       const std::string& field);

}  // namespace blockwalk
