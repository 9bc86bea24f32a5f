// SPDX-License-Identifier: Apache-2.0
// Finders: the first block at or after ray parameter t that the ray crosses with positive length, or kNone.

// Hierarchical DDA over block occupancy: tiles of 8^3 blocks, then the blocks of a tile.
uint findByGrid(Ray ray, float t, inout Work work) {
  const float tile_voxels = float(kGridTileSide * kBlockVoxels);
  vec3 corner = vec3(-frame.anchor);
  Dda tiles = enterDda(ray, corner, tile_voxels, frame.tile_dims, t);
  int tile_bound = frame.tile_dims.x + frame.tile_dims.y + frame.tile_dims.z;
  for (int i = 0; i <= tile_bound; ++i) {
    ivec3 tile_cell = tiles.cell;
    if (!insideLattice(tile_cell, frame.tile_dims) || tiles.t >= ray.t_max) return kNone;
    uint tile = UintArray(frame.grid_tiles)
                    .at[uint(tile_cell.x + frame.tile_dims.x * (tile_cell.y + frame.tile_dims.y * tile_cell.z))];
    if (tile != kNone && tiles.t_exit > tiles.t) {
      Dda cells = enterDda(ray, corner + vec3(tile_cell) * tile_voxels, float(kBlockVoxels), ivec3(kGridTileSide), tiles.t);
      for (int j = 0; j <= 3 * kGridTileSide; ++j) {
        if (!insideLattice(cells.cell, ivec3(kGridTileSide)) || cells.t >= ray.t_max) break;
        uint local = uint(cells.cell.x + kGridTileSide * (cells.cell.y + kGridTileSide * cells.cell.z));
        uint block = UintArray(frame.grid_cells).at[tile * 512u + local];
        if (block != kNone && cells.t_exit > cells.t && !blockIsCulled(block)) return block;
        stepDda(ray, float(kBlockVoxels), cells);
      }
    }
    stepDda(ray, tile_voxels, tiles);
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
  vec3 origin = ray.origin + ray.dir * t_start + vec3(frame.anchor);
  rayQueryEXT query;
  rayQueryInitializeEXT(query, instances, gl_RayFlagsNoneEXT, kCull ? frame.range_mask : 0xffu, origin,
                        t_query, ray.dir, ray.t_max - t_start + slack);
  float best = ray.t_max;
  uint found = kNone;
  while (rayQueryProceedEXT(query)) {
    uint block = uint(rayQueryGetIntersectionInstanceIdEXT(query, false));
    vec2 interval = blockInterval(ray, block);
    float entry = max(interval.x, t);
    if (interval.y > entry && entry < best && !blockIsCulled(block)) {
      best = entry;
      found = block;
      rayQueryGenerateIntersectionEXT(query, max(entry - t_start, t_query) + slack);
    }
  }
  return found;
}
#endif

uint findBlock(Ray ray, float t, inout Work work) {
  work.queries += 1u;
#ifdef BLOCKWALK_RAY_QUERY
  if (kFinder == kFinderQuery) return findByQuery(ray, t, work);
#endif
  return findByGrid(ray, t, work);
}
