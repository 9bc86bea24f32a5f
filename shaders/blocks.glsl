// SPDX-License-Identifier: Apache-2.0
// The resident blocks: where they lie, whether the range can see them, who their neighbours are.

#define blockAt(index) BlockArray(scene.blocks).at[index]

vec3 blockCorner(uint block) { return vec3(blockAt(block).origin) - scene.anchor; }

vec2 blockInterval(Ray ray, uint block) { return cubeInterval(ray, blockCorner(block), float(kBlockVoxels)); }

// Derin et al. 2021, 2.3. Mask, minimum and maximum each prove absence, none proves presence.
bool blockMeetsRange(uint block) {
  return (blockAt(block).range_mask & scene.range_mask) != 0u && blockAt(block).density_max >= scene.density_lo &&
         blockAt(block).density_min <= scene.density_hi;
}

// Rank of the local subblock in the block, or kNoSubblock.
uint subblockRank(uint block, uint local) {
  return (blockAt(block).indices[local >> 2] >> ((local & 3u) * 8u)) & 255u;
}

bool blockIsCulled(uint block) { return kCull && !blockMeetsRange(block); }

bool subblockIsCulled(uint subblock) {
  if (!kCull) return false;
  GpuSubblock record = SubblockArray(scene.subblocks).at[subblock];
  return (record.range_mask & scene.range_mask) == 0u || record.density_max < scene.density_lo ||
         record.density_min > scene.density_hi;
}

// Block walking (Derin et al. 2021, 2.2): the block behind the face through which the ray leaves, or kNone.
uint walkFrom(Ray ray, uint block, float t_exit) {
  vec3 far = planeT(ray, blockCorner(block) + float(kBlockVoxels) * ray.forward);
  uint axis = far.x == t_exit ? 0u : (far.y == t_exit ? 1u : 2u);
  float up = axis == 0u ? ray.forward.x : (axis == 1u ? ray.forward.y : ray.forward.z);
  return blockAt(block).neighbours[2u * axis + uint(up)];
}
