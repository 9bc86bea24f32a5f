// SPDX-License-Identifier: Apache-2.0
// Block occupancy for the grid finder: tiles of 8^3 blocks, cells only for tiles that hold a block.
#pragma once

#include <vector>

#include "volume/volume.h"

namespace blockwalk {

struct BlockGrid {
  glm::ivec3 tile_dims{0};
  std::vector<std::uint32_t> tiles;  // x fastest: number of the tile's 512 cells, or kNoBlock
  std::vector<std::uint32_t> cells;  // 512 a stored tile, x fastest: block index, or kNoBlock
};

BlockGrid buildBlockGrid(const Level& level, int block_voxels);

}  // namespace blockwalk
