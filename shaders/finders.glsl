// SPDX-License-Identifier: Apache-2.0
// Finders: the first block at or after ray parameter t that the ray crosses with positive length, or kNone.

// Hierarchical DDA over block occupancy: tiles of 8^3 blocks, then the blocks of a tile.
uint findInTile(Ray ray, uint tile, vec3 corner, float t_begin, float t_end, inout Work work) {
  const vec3 count = vec3(kGridTileSide);
  Dda blocks = enterDda(ray, corner, float(kBlockVoxels), count, latticeStrides(count), t_begin);
  for (int i = 0; i <= 3 * kGridTileSide; ++i) {
    uint block = UintArray(scene.finder.grid_blocks).at[tile * 512u + wholeNumber(blocks.index)];
    if (block != kNone && blocks.t_exit > blocks.t && !isPassedOver(block)) return block;
    if (blocks.t_exit >= t_end) return kNone;
    stepDda(ray, float(kBlockVoxels), latticeStrides(count), blocks);
  }
  work.loop_bound_hits += 1u;
  return kNone;
}

uint findByGrid(Ray ray, float t, inout Work work) {
  const float tile_voxels = float(kGridTileSide * kBlockVoxels);
  vec3 count = vec3(scene.finder.tile_dims);
  Dda tiles = enterDda(ray, -scene.anchor, tile_voxels, count, latticeStrides(count), t);
  int bound = scene.finder.tile_dims.x + scene.finder.tile_dims.y + scene.finder.tile_dims.z;
  for (int i = 0; i <= bound; ++i) {
    uint tile = UintArray(scene.finder.grid_tiles).at[uint(tiles.index)];  // up to 2^24: more than wholeNumber() takes
    float t_end = min(tiles.t_exit, ray.t_max);
    if (tile != kNone && t_end > tiles.t) {
      vec3 corner = tiles.far - tile_voxels * ray.forward;
      uint block = findInTile(ray, tile, corner, tiles.t, t_end, work);
      if (block != kNone) return block;
    }
    if (tiles.t_exit >= ray.t_max) return kNone;
    stepDda(ray, tile_voxels, latticeStrides(count), tiles);
  }
  work.loop_bound_hits += 1u;
  return kNone;
}

#ifdef BLOCKWALK_RAY_QUERY
// One instance a block over a unit box (Derin et al. 2021, 2.1). The boxes are a little larger than the blocks and the
// query starts a little early, so the driver's rounding loses no block; the exact interval decides here.
uint findByQuery(Ray ray, float t, inout Work work) {
  float t_start = max(ray.t_min, ray.t_eye);
  float slack = 1e-3 * float(kBlockVoxels) * min3(abs(ray.inverse));
  float t_query = max(t - t_start - slack, 0.0);
  vec3 origin = ray.origin + ray.dir * t_start + scene.anchor;
  rayQueryEXT query;
  // The mask of one range speaks for one channel.
  uint mask = kCull && kChannels == 1 ? scene.channels[0].range_mask : 0xffu;
  rayQueryInitializeEXT(query, instances, gl_RayFlagsNoneEXT, mask, origin, t_query, ray.dir, ray.t_max - t_start + slack);
  float best = ray.t_max;
  uint found = kNone;
  while (rayQueryProceedEXT(query)) {
    uint block = uint(rayQueryGetIntersectionInstanceIdEXT(query, false));
    vec2 interval = blockInterval(ray, block);
    float entry = max(interval.x, t);
    if (interval.y > entry && entry < best && !isPassedOver(block)) {
      best = entry;
      found = block;
      rayQueryGenerateIntersectionEXT(query, max(entry - t_start, t_query) + slack);
    }
  }
  return found;
}
#endif

#include "regions.glsl"

// `span` is the part of the ray behind `t` that may show something, where the finder says so (kFindsIntervals).
uint findBlock(Ray ray, float t, inout vec2 span, inout Work work) {
#ifdef BLOCKWALK_RAY_QUERY
  if (kFinder == kFinderClusters || kFinder == kFinderBoundary) return findInRegion(ray, t, span, work);
#endif
  work.queries += 1u;
  if (kFinder == kFinderOctree) return findByOctree(ray, t, span, work);
#ifdef BLOCKWALK_RAY_QUERY
  if (kFinder == kFinderQuery) return findByQuery(ray, t, work);
#endif
  return findByGrid(ray, t, work);
}
