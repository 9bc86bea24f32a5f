// SPDX-License-Identifier: Apache-2.0
// Volumes of few slices: what lies beyond their sides is stored with whole subblocks.
#pragma once

#include <glm/glm.hpp>

namespace blockwalk {

// How many voxels are stored for one of a full volume.
double paddingFactor(glm::ivec3 dims, int subblock_side);

// 8, or 4 where that stores a quarter less.
int fittingSubblockSide(glm::ivec3 dims);

}  // namespace blockwalk
