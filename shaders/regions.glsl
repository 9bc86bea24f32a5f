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

// The part of the ray behind t in the box that it enters first (Ganter & Manzke 2019). The boxes that the driver
// knows are larger and the query starts early; the exact interval decides. Empty where there is none.
vec2 nextCluster(Ray ray, float t, inout Work work) {
  work.queries += 1u;
  DriverRay driver = driverRay(ray);
  float slack = 0.0625 * scene.finder.macrocell_voxels;
  float query_start = max((t - driver.t_start) * driver.scale - slack, 0.0);
  rayQueryEXT query;
  rayQueryInitializeEXT(query, instances, gl_RayFlagsNoneEXT, 0xffu, driver.origin, query_start, driver.dir,
                        (ray.t_max - driver.t_start) * driver.scale + slack);
  vec2 best = vec2(ray.t_max);
  while (rayQueryProceedEXT(query)) {
    int box = rayQueryGetIntersectionPrimitiveIndexEXT(query, false);
    vec2 interval = boxInterval(ray, BoxArray(scene.finder.boxes).at[2 * box], BoxArray(scene.finder.boxes).at[2 * box + 1]);
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
                        (ray.t_max - driver.t_start) * driver.scale + scene.finder.macrocell_voxels);
  while (rayQueryProceedEXT(query)) {
  }
  if (rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionNoneEXT) return kHugeT;
  return driver.t_start + rayQueryGetIntersectionTEXT(query, true) / driver.scale;
}

// Bytes, read by the word (voxel_words.glsl says why).
uint macrocellState(Dda macrocells) {
  uint macrocell = uint(macrocells.index);  // up to 2^24: more than wholeNumber() takes
  return UintArray(scene.finder.macrocell_states).at[macrocell >> 2] >> (8u * (macrocell & 3u)) & 255u;
}

Dda enterMacrocells(Ray ray, float t) {
  vec3 count = vec3(scene.finder.macrocell_dims);
  return enterDda(ray, -scene.anchor, scene.finder.macrocell_voxels, count, latticeStrides(count), t);
}

// Where the ray enters the macrocell at hand, whatever t it was found by.
float entryOf(Ray ray, Dda macrocells) {
  return max3(planeT(ray, macrocells.far - scene.finder.macrocell_voxels * (2.0 * ray.forward - 1.0)));
}

// Where the active macrocells end that follow the one at hand (Wald et al. 2021, 4.3). The faces bound all that lies
// near active macrocells, so the next one out is not before that; it may be behind it, and a macrocell that is not
// active then counts among them.
float exitOf(Ray ray, Dda macrocells, inout Work work) {
  float t_out = nextFace(ray, macrocells.t, false, work);
  if (t_out >= ray.t_max) return ray.t_max;
  Dda last = enterMacrocells(ray, max(t_out, macrocells.t));
  return macrocellState(last) == kMacrocellActive ? last.t_exit : max(macrocells.t_exit, entryOf(ray, last));
}

// The part of the ray behind t from the first active macrocell to where the active macrocells end. Empty where there is none. Beside
// active macrocells it goes from macrocell to macrocell, because there the driver cannot tell inside from outside; from any other macrocell
// it goes to the next face that leads in.
vec2 nextActive(Ray ray, float t, inout Work work) {
  const vec2 nothing = vec2(ray.t_max);
  Dda macrocells = enterMacrocells(ray, t);
  // Every macrocell is entered once at most, and again by one jump to it.
  int bound = 2 * (scene.finder.macrocell_dims.x + scene.finder.macrocell_dims.y + scene.finder.macrocell_dims.z) + 8;
  for (int i = 0; i < bound; ++i) {
    uint state = macrocellState(macrocells);
    if (state == kMacrocellActive && macrocells.t_exit > macrocells.t) return vec2(macrocells.t, exitOf(ray, macrocells, work));
    if (macrocells.t_exit >= ray.t_max) return nothing;
    float t_in = state == kMacrocellCalm ? nextFace(ray, macrocells.t, true, work) : 0.0;
    if (state == kMacrocellCalm && t_in >= ray.t_max) return nothing;
    if (state == kMacrocellCalm && t_in >= macrocells.t_exit) {
      float before = macrocells.t_exit;
      macrocells = enterMacrocells(ray, t_in);
      macrocells.t = max(before, entryOf(ray, macrocells));
    } else {
      stepDda(ray, scene.finder.macrocell_voxels, latticeStrides(vec3(scene.finder.macrocell_dims)), macrocells);
    }
  }
  work.loop_bound_hits += 1u;
  return nothing;
}

// The next block that the grid has where the ray crosses what is active: from t on, or from the next such part.
uint findInRegion(Ray ray, float t, inout vec2 span, inout Work work) {
  int bound = scene.finder.macrocell_dims.x + scene.finder.macrocell_dims.y + scene.finder.macrocell_dims.z + 4;
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
