// SPDX-License-Identifier: Apache-2.0
// Small deterministic volumes that are hard on a renderer: clumps of noise with gaps between them, sharp faces, single
// voxels, NaN and infinity in f32, a value map, any index-to-world map.
#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <memory>

#include "volume/source.h"

namespace blockwalk::test {

struct SyntheticOptions {
  VoxelType type = VoxelType::rgba8;
  glm::ivec3 dims{64};
  std::uint32_t seed = 1;
  glm::dmat4 world_from_index{1.0};
  // Fields of their own, with value maps of their own; not rgba8. Channel c of this is channel 0 of one with
  // first_channel = c.
  int channels = 1;
  int first_channel = 0;
};

std::unique_ptr<Source> makeSynthetic(const SyntheticOptions& options);

// Of u8: the density of each voxel.
std::unique_ptr<Source> makeVoxels(glm::ivec3 dims, std::function<int(glm::ivec3)> density);

// Rotated about an oblique axis, spacing (1, 1.3, 2.4), shifted; `mirrored` turns one axis round.
glm::dmat4 obliqueMap(bool mirrored);

}  // namespace blockwalk::test
