#version 460
// SPDX-License-Identifier: Apache-2.0
// The macrocell grid (Wald et al. 2021, 4.1.1): least and greatest density and range mask of a channel in every
// macrocell, from the records of its subblocks. An empty macrocell has an empty mask.
#extension GL_GOOGLE_include_directive : require
#include "region.glsl"

layout(push_constant, scalar) uniform Push { MacrocellPush push; };

// The record of the subblock at a place in subblocks of the level; an empty mask where none is stored.
GpuSubblock recordAt(ivec3 place) {
  GpuSubblock nothing = GpuSubblock(0.0, 0.0, 0u);
  ivec3 block_place = place / push.block_side;
  ivec3 tile = block_place / kGridTileSide;
  if (!isInside(tile, push.tile_dims)) return nothing;
  uint places = UintArray(push.grid_tiles).at[latticeIndex(tile, push.tile_dims)];
  if (places == kNone) return nothing;
  uint place_in_tile = latticeIndex(block_place - kGridTileSide * tile, ivec3(kGridTileSide));
  uint block = UintArray(push.grid_blocks).at[512u * places + place_in_tile];
  if (block == kNone) return nothing;
  uint local = latticeIndex(place - push.block_side * block_place, ivec3(push.block_side));
  uint rank = (BlockArray(push.blocks).at[block].indices[local >> 2] >> ((local & 3u) * 8u)) & 255u;
  if (rank == kNoSubblock) return nothing;
  return SubblockArray(push.subblocks).at[BlockArray(push.blocks).at[block].first_subblock + rank];
}

void main() {
  ivec3 macrocell = ivec3(gl_GlobalInvocationID);
  if (!isInside(macrocell, push.macrocell_dims)) return;
  int side = push.macrocell_voxels / push.subblock_side;
  GpuSubblock range = GpuSubblock(0.0, 0.0, 0u);
  for (int i = 0; i < side * side * side; ++i) {
    GpuSubblock record = recordAt(macrocell * side + ivec3(i % side, i / side % side, i / (side * side)));
    if (record.range_mask == 0u) continue;
    bool first = range.range_mask == 0u;
    range.density_min = first ? record.density_min : min(range.density_min, record.density_min);
    range.density_max = first ? record.density_max : max(range.density_max, record.density_max);
    range.range_mask |= record.range_mask;
  }
  RangeArray(push.ranges).at[latticeIndex(macrocell, push.macrocell_dims)] = range;
  if (range.range_mask != 0u) atomicAdd(Counter(push.occupied).count, 1u);
}
