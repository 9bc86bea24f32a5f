// SPDX-License-Identifier: Apache-2.0
// finders clusters and boundary: between which t a ray crosses macrocells in which something may be seen. The driver's
// hits only say where to look; every t that is returned is planeT() of a macrocell's plane (docs/finders.md).
#ifdef BLOCKWALK_RAY_QUERY

// A ray for the driver, of a direction whose largest component is 1, from where ours enters the box.
struct DriverRay {
  vec3 origin;  // index space of the level
  vec3 dir;
  float t_start;
  float scale;  // the driver's t = (t - t_start) * scale
};

DriverRay driverRay(Ray ray) {
  float t_start = max(ray.t_min, ray.t_eye);
  float scale = max3(abs(ray.dir));
  return DriverRay(ray.origin + ray.dir * t_start + scene.anchor, ray.dir / scale, t_start, scale);
}

vec2 boxInterval(Ray ray, vec3 lo, vec3 hi) {
  vec3 near = planeT(ray, mix(hi, lo, ray.forward) - scene.anchor);
  vec3 far = planeT(ray, mix(lo, hi, ray.forward) - scene.anchor);
  return vec2(max3(near), min3(far));
}

int found_cluster = 0;  // the box that nextCluster() found last, for output mesh

// The part of the ray behind t in the box that it enters first (Ganter & Manzke 2019). The boxes that the driver knows are
// larger and the query starts early; the exact interval decides. Empty where there is none.
vec2 nextCluster(Ray ray, float t, inout Work work) {
  work.queries += 1u;
  DriverRay driver = driverRay(ray);
  float slack = 0.0625 * scene.cell_voxels;
  float query_start = max((t - driver.t_start) * driver.scale - slack, 0.0);
  rayQueryEXT query;
  rayQueryInitializeEXT(query, instances, gl_RayFlagsNoneEXT, 0xffu, driver.origin, query_start, driver.dir,
                        (ray.t_max - driver.t_start) * driver.scale + slack);
  vec2 best = vec2(ray.t_max);
  while (rayQueryProceedEXT(query)) {
    int box = rayQueryGetIntersectionPrimitiveIndexEXT(query, false);
    vec2 interval = boxInterval(ray, BoxArray(scene.boxes).at[2 * box], BoxArray(scene.boxes).at[2 * box + 1]);
    interval.x = max(interval.x, t);
    if (interval.y > interval.x && interval.x < best.x) {
      best = interval;
      if (kOutput == kOutputMesh) found_cluster = box;
      rayQueryGenerateIntersectionEXT(query, max((best.x - driver.t_start) * driver.scale, query_start) + slack);
    }
  }
  return best;
}

// t of the nearest face of the boundary at or behind t, as the driver sees it: of those that lead in, or out.
float nextFace(Ray ray, float t, bool leads_in, inout Work work) {
  work.queries += 1u;
  DriverRay driver = driverRay(ray);
  rayQueryEXT query;
  uint facing = leads_in ? gl_RayFlagsCullBackFacingTrianglesEXT : gl_RayFlagsCullFrontFacingTrianglesEXT;
  rayQueryInitializeEXT(query, instances, gl_RayFlagsOpaqueEXT | facing, 0xffu, driver.origin,
                        max((t - driver.t_start) * driver.scale, 0.0), driver.dir,
                        (ray.t_max - driver.t_start) * driver.scale + scene.cell_voxels);
  while (rayQueryProceedEXT(query)) {
  }
  if (rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionNoneEXT) return kHugeT;
  return driver.t_start + rayQueryGetIntersectionTEXT(query, true) / driver.scale;
}

// Bytes, read by the word (voxel_words.glsl says why).
uint cellState(Dda cells) {
  uint cell = uint(cells.index);  // up to 2^24: more than wholeNumber() takes
  return UintArray(scene.cell_states).at[cell >> 2] >> (8u * (cell & 3u)) & 255u;
}

Dda enterCells(Ray ray, float t) {
  vec3 count = vec3(scene.cell_dims);
  return enterDda(ray, -scene.anchor, scene.cell_voxels, count, latticeStrides(count), t);
}

// Where the ray enters the cell at hand, whatever t it was found by.
float entryOf(Ray ray, Dda cells) { return max3(planeT(ray, cells.far - scene.cell_voxels * (2.0 * ray.forward - 1.0))); }

// Where the active cells end that follow the one at hand (Wald et al. 2021, 4.3). The faces bound all that lies near active
// cells, so the next one out is not before that; it may be behind it, and a cell that is not active then counts among them.
float exitOf(Ray ray, Dda cells, inout Work work) {
  float t_out = nextFace(ray, cells.t, false, work);
  if (t_out >= ray.t_max) return ray.t_max;
  Dda last = enterCells(ray, max(t_out, cells.t));
  return cellState(last) == kCellActive ? last.t_exit : max(cells.t_exit, entryOf(ray, last));
}

// The part of the ray behind t from the first active cell to where the active cells end. Empty where there is none. Beside
// active cells it goes from cell to cell, because there the driver cannot tell inside from outside; from any other cell
// it goes to the next face that leads in.
vec2 nextActive(Ray ray, float t, inout Work work) {
  const vec2 nothing = vec2(ray.t_max);
  Dda cells = enterCells(ray, t);
  // Every cell is entered once at most, and again by one jump to it.
  int bound = 2 * (scene.cell_dims.x + scene.cell_dims.y + scene.cell_dims.z) + 8;
  for (int i = 0; i < bound; ++i) {
    uint state = cellState(cells);
    if (state == kCellActive && cells.t_exit > cells.t) return vec2(cells.t, exitOf(ray, cells, work));
    if (cells.t_exit >= ray.t_max) return nothing;
    float t_in = state == kCellCalm ? nextFace(ray, cells.t, true, work) : 0.0;
    if (state == kCellCalm && t_in >= ray.t_max) return nothing;
    if (state == kCellCalm && t_in >= cells.t_exit) {
      float before = cells.t_exit;
      cells = enterCells(ray, t_in);
      cells.t = max(before, entryOf(ray, cells));
    } else {
      stepDda(ray, scene.cell_voxels, latticeStrides(vec3(scene.cell_dims)), cells);
    }
  }
  work.loop_bound_hits += 1u;
  return nothing;
}

// The next block that the grid has where the ray crosses what is active: from t on, or from the next such part.
uint findInRegion(Ray ray, float t, inout vec2 span, inout Work work) {
  int bound = scene.cell_dims.x + scene.cell_dims.y + scene.cell_dims.z + 4;
  for (int i = 0; i < bound; ++i) {
    if (t >= span.y) {
      span = kFinder == kFinderClusters ? nextCluster(ray, t, work) : nextActive(ray, t, work);
      if (span.x >= min(span.y, ray.t_max)) return kNone;
    }
    Ray part = ray;
    part.t_max = min(span.y, ray.t_max);
    uint block = findByGrid(part, max(t, span.x), work);
    if (block != kNone) return block;
    t = span.y;
    if (t >= ray.t_max) return kNone;
  }
  work.loop_bound_hits += 1u;
  return kNone;
}

#endif
