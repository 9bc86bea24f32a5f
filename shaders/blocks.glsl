// SPDX-License-Identifier: Apache-2.0
// The resident blocks: where they lie, whether the ranges can see them, who their neighbours are.

// A block as a drawn channel has it; what all channels have in common is read from the first.
#define channelBlockAt(c, index) BlockArray(scene.channels[c].blocks).at[index]
#define blockAt(index) channelBlockAt(0, index)

vec3 blockCorner(uint block) { return vec3(blockAt(block).origin) - scene.anchor; }

vec2 blockInterval(Ray ray, uint block) { return cubeInterval(ray, blockCorner(block), float(kBlockVoxels)); }

// Derin et al. 2021, 2.3. Mask, minimum and maximum each prove absence, none proves presence.
bool blockMeetsRange(uint block) {
  bool meets = false;
  forEachChannel(c) {
    meets = meets || ((channelBlockAt(c, block).range_mask & scene.channels[c].range_mask) != 0u &&
                      channelBlockAt(c, block).density_max >= scene.channels[c].density_lo &&
                      channelBlockAt(c, block).density_min <= scene.channels[c].density_hi);
  }
  return meets;
}

// Rank of the local subblock in the block, or kNoSubblock.
uint subblockRank(uint block, uint local) {
  return (blockAt(block).indices[local >> 2] >> ((local & 3u) * 8u)) & 255u;
}

// Where every block shows something, it is quarters that are culled.
bool blockIsCulled(uint block) { return kCull && !kRangeOpen && !blockMeetsRange(block); }

// Whether what a finder returns must not be culled. A ray that counts blocks and walks comes through those that are anyway.
bool isPassedOver(uint block) { return !(kMode == kModeBlocks && kWalk) && blockIsCulled(block); }

// Block walking (Derin et al. 2021, 2.2): the block behind the face through which the ray leaves, or kNone.
uint walkFrom(Ray ray, uint block, float t_exit) {
  vec3 far = planeT(ray, blockCorner(block) + float(kBlockVoxels) * ray.forward);
  uint axis = far.x == t_exit ? 0u : (far.y == t_exit ? 1u : 2u);
  float up = axis == 0u ? ray.forward.x : (axis == 1u ? ray.forward.y : ray.forward.z);
  return blockAt(block).neighbours[2u * axis + (up > 0.0 ? 1u : 0u)];
}
