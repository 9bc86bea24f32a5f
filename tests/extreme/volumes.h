// SPDX-License-Identifier: Apache-2.0
// Volumes and views that extreme cases are made from.
#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "tests/renderer/synthetic.h"
#include "view/view.h"
#include "volume/source.h"

namespace blockwalk::extreme {

using Density = std::function<float(glm::ivec3)>;

// Spacing along each axis, no rotation.
glm::dmat4 spacing(glm::dvec3 voxel);

// data = offset + scale * stored
struct ValueMap {
  double scale = 1;
  double offset = 0;
};

// A volume whose density is a function of the voxel; rgba8 has the colour (white) and the density's byte.
std::shared_ptr<Source> fill(VoxelType type, glm::ivec3 dims, const Density& density,
                             const glm::dmat4& world_from_index = glm::dmat4(1), ValueMap values = {});

// A number 0..1 that looks random, the same for the same voxel.
double noise(glm::ivec3 voxel);

// Clumps of noise, sharp faces and single voxels (tests/renderer/synthetic.h).
std::shared_ptr<Source> clumps(VoxelType type, glm::ivec3 dims, const glm::dmat4& world_from_index = glm::dmat4(1));

// A view of 24x16 pixels, eye, target and up in index space, over a background that nothing else looks like.
View look(const glm::dmat4& world_from_index, glm::dvec3 eye, glm::dvec3 target, glm::dvec3 up = {0.1, 1, 0.2});

// The same, orthographic, with one pixel every `pitch` of index space along the image's height.
View lookStraight(const glm::dmat4& world_from_index, glm::dvec3 eye, glm::dvec3 target, glm::dvec3 up, double pitch);

// Colour from black to white and opacity up to `opacity` over [lo, hi].
std::vector<TransferPoint> ramp(double lo, double hi, double opacity);

// White, of one opacity everywhere.
std::vector<TransferPoint> white(double opacity);

}  // namespace blockwalk::extreme
