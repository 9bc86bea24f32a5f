// SPDX-License-Identifier: Apache-2.0
#include "renderer/find/block_grid.h"

#include "shaders/kernel_interface.h"

namespace blockwalk {
namespace {

std::size_t latticeIndex(glm::ivec3 cell, glm::ivec3 dims) {
  return static_cast<std::size_t>(cell.x) +
         static_cast<std::size_t>(dims.x) *
             (static_cast<std::size_t>(cell.y) + static_cast<std::size_t>(dims.y) * static_cast<std::size_t>(cell.z));
}

}  // namespace

BlockGrid buildBlockGrid(const Level& level, int block_voxels) {
  constexpr int kSide = gpu::kGridTileSide;
  BlockGrid grid;
  grid.tile_dims = latticeDims(latticeDims(level.info.dims, block_voxels), kSide);
  grid.tiles.assign(latticeIndex({0, 0, grid.tile_dims.z}, grid.tile_dims), kNoBlock);
  for (std::size_t i = 0; i < level.blocks.size(); ++i) {
    const glm::ivec3 origin = level.blocks[i].origin;
    std::uint32_t& tile = grid.tiles[latticeIndex(origin / kSide, grid.tile_dims)];
    if (tile == kNoBlock) {
      tile = static_cast<std::uint32_t>(grid.blocks.size() / (kSide * kSide * kSide));
      grid.blocks.resize(grid.blocks.size() + kSide * kSide * kSide, kNoBlock);
    }
    grid.blocks[std::size_t{tile} * kSide * kSide * kSide + latticeIndex(origin % kSide, glm::ivec3(kSide))] =
        static_cast<std::uint32_t>(i);
  }
  return grid;
}

}  // namespace blockwalk
