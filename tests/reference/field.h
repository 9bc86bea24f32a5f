// SPDX-License-Identifier: Apache-2.0
// The linearly filtered field of one level (docs/integration.md, The field): trilinear between voxel centres, clamped
// to the edge, empty voxels at the empty value.
//
// A value of the field is (r d, g d, b d, d): the density d in stored units and, for rgba8, the colour (0..1) times it.
// Positions are in the level's index space and may lie outside the volume.
#pragma once

#include <array>
#include <glm/glm.hpp>

#include "tests/reference/dense_volume.h"
#include "tests/reference/ray.h"

namespace blockwalk::reference {

// What an empty voxel counts as, stored units: data value 0 as far as the stored type can hold it if that is empty too,
// else the empty threshold; 0 for rgba8.
double emptyValue(const DenseVolume& volume);

bool isEmpty(const DenseVolume& volume, float stored);

// Of the nearest voxel inside the volume.
glm::dvec4 voxelField(const DenseVolume& volume, glm::ivec3 voxel);

glm::dvec4 fieldAt(const DenseVolume& volume, glm::dvec3 position);

// Central differences of the density, `reach` voxels to each side; stored units per voxel.
glm::dvec3 gradientAt(const DenseVolume& volume, glm::dvec3 position, double reach);

// The eight voxels whose centres surround a position: centre of corner 0 at `base` + 0.5, corner bits x, y, z.
struct Cell {
  glm::dvec3 base{0};
  std::array<glm::dvec4, 8> corners{};

  glm::dvec4 at(glm::dvec3 position) const;
  bool isFlat() const;  // one density in all corners: no arithmetic can get it wrong
};

Cell cellAround(const DenseVolume& volume, glm::dvec3 position);

// Inside a cell the field along a ray is a cubic: field(t) = sum of c[i] (t - t_origin)^i.
struct Cubic {
  double t_origin = 0;
  std::array<glm::dvec4, 4> c{};

  glm::dvec4 at(double t) const;
  double slopeAt(double t) const;  // of the density, stored units per world unit
};

Cubic cubicAlong(const Cell& cell, const Ray& index_ray, double t_origin);

}  // namespace blockwalk::reference
