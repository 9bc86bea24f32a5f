// SPDX-License-Identifier: Apache-2.0
// finder none: the whole box is marched, as the base that skipping is measured against (Wald et al. 2021, 5: Base). Every
// block cell, every subblock and every voxel or sample on the ray is visited. Where nothing is stored the voxels are those
// of one subblock of empty ones, so that the march pays its loads.

uint blockAtCell(vec3 corner) {
  ivec3 cell = ivec3((corner + scene.anchor) * (1.0 / float(kBlockVoxels)) + 0.5);
  ivec3 tile = cell / kGridTileSide;
  uint cells = UintArray(scene.grid_tiles).at[tile.x + scene.tile_dims.x * (tile.y + scene.tile_dims.y * tile.z)];
  if (cells == kNone) return kNone;
  ivec3 local = cell - kGridTileSide * tile;
  return UintArray(scene.grid_cells).at[cells * 512u + uint(local.x + kGridTileSide * (local.y + kGridTileSide * local.z))];
}

SubblockVoxels emptySubblock() {
  SubblockVoxels voxels;
  forEachChannel(c) voxels.at[c] = scene.channels[c].empty;
  voxels.channels = 0u;
  voxels.cells = uvec2(0u);
  return voxels;
}

SubblockVoxels subblockOrEmpty(uint block, uint local) {
  if (block == kNone) return emptySubblock();
  uint rank = subblockRank(block, local);
  if (rank == kNoSubblock) return emptySubblock();
  return subblockOfRank(firstSubblock(block), rank);
}

void marchBlock(Ray ray, uint block, vec3 corner, float t_begin, float t_end, inout Ink ink, inout Work work) {
  const vec3 count = vec3(kBlockSide);
  const float side = float(kSubblockSide);
  Dda subblocks = enterDda(ray, corner, side, count, latticeStrides(count), t_begin);
  for (int i = 0; i <= 3 * kBlockSide; ++i) {
    float t_exit = min(subblocks.t_exit, t_end);
    if (t_exit > subblocks.t) {
      if (kTally) work.subblock_visits += 1u;
      integrateSubblock(ray, block, subblockOrEmpty(block, wholeNumber(subblocks.index)), subblocks.far - side * ray.forward,
                        subblocks.t, t_exit, ink, work);
    }
    if (ink.done || subblocks.t_exit >= t_end) return;
    stepDda(ray, side, latticeStrides(count), subblocks);
  }
  work.loop_bound_hits += 1u;
}

// Returns the count of blocks crossed that the ranges meet.
uint marchBox(Ray ray, inout Ink ink, inout Work work) {
  uint crossed = 0u;
  if (ray.t_min >= ray.t_max) return crossed;
  const float side = float(kBlockVoxels);
  vec3 count = vec3(frame.block_dims);
  Dda cells = enterDda(ray, -scene.anchor, side, count, latticeStrides(count), ray.t_min);
  int bound = frame.block_dims.x + frame.block_dims.y + frame.block_dims.z;
  for (int i = 0; i <= bound; ++i) {
    float t_exit = min(cells.t_exit, ray.t_max);
    if (t_exit > cells.t) {
      vec3 corner = cells.far - side * ray.forward;
      uint block = blockAtCell(corner);
      if (kTally) work.block_visits += 1u;
      if (kMode != kModeBlocks) {
        marchBlock(ray, block, corner, cells.t, t_exit, ink, work);
      } else if (block != kNone) {
        crossed += kRangeOpen || blockMeetsRange(block) ? 1u : 0u;
      }
    }
    if (ink.done || cells.t_exit >= ray.t_max) return crossed;
    stepDda(ray, side, latticeStrides(count), cells);
  }
  work.loop_bound_hits += 1u;
  return crossed;
}
