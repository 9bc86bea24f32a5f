// SPDX-License-Identifier: Apache-2.0
// finder none: the whole box is marched, as the base that skipping is measured against (Wald et al. 2021, 5: Base).
// Every place of a block, every subblock and every voxel or sample on the ray is visited. Where nothing is stored
// the voxels are those of one subblock of empty ones, so that the march pays its loads.

// The place of a block at t: its lowest corner, and the block there or kNone.
uint blockAtT(Ray ray, float t, out vec3 corner) {
  const float side = float(kBlockVoxels);
  vec3 count = vec3(scene.block_dims);
  Dda blocks = enterDda(ray, -scene.anchor, side, count, latticeStrides(count), t);
  corner = blocks.far - side * ray.forward;
  ivec3 place = ivec3((corner + scene.anchor) * (1.0 / side) + 0.5);
  ivec3 tile = place / kGridTileSide;
  uint at = UintArray(scene.finder.grid_tiles).at[tile.x + scene.finder.tile_dims.x * (tile.y + scene.finder.tile_dims.y * tile.z)];
  if (at == kNone) return kNone;
  ivec3 local = place - kGridTileSide * tile;
  return UintArray(scene.finder.grid_blocks).at[at * 512u + uint(local.x + kGridTileSide * (local.y + kGridTileSide * local.z))];
}

SubblockVoxels emptySubblock() {
  SubblockVoxels voxels;
  forEachChannel(c) voxels.at[c] = scene.channels[c].empty;
  voxels.channels = 0u;
  voxels.quarters = uvec2(0u);
  return voxels;
}
