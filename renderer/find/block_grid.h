// SPDX-License-Identifier: Apache-2.0
// Block occupancy for the grid finder: tiles of 8^3 places of blocks, stored only where a tile holds a block.
#pragma once

#include <vector>

#include "volume/volume.h"

namespace blockwalk {

struct BlockGrid {
  glm::ivec3 tile_dims{0};
  std::vector<std::uint32_t> tiles;   // x fastest: number of the tile's 512 places, or kNoBlock
  std::vector<std::uint32_t> blocks;  // 512 a stored tile, x fastest: block index, or kNoBlock
};

BlockGrid buildBlockGrid(const Level& level, int block_voxels);

}  // namespace blockwalk
