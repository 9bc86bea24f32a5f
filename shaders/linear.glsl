// SPDX-License-Identifier: Apache-2.0
// filter linear: samples of the trilinear field in the middles of the intervals of one lattice along the ray
// (docs/integration.md, "Samples"). A sample belongs to the subblock in which its t lies, whoever found it.

// Interval k of the lattice, cut to the ray.
vec2 latticeInterval(Ray ray, float k) {
  return clamp(vec2(k, k + 1.0) * ray.dt, vec2(ray.t_min), vec2(ray.t_max));
}

float middleOf(vec2 interval) { return 0.5 * (interval.x + interval.y); }

// The first interval whose middle is at or after t, or the one before it.
float latticeIndex(Ray ray, float t) { return floor(t / ray.dt - 0.5); }

vec3 placeAt(Ray ray, float t) { return ray.start + ray.dir * t; }

// The subblock at a place near `block`, and the place relative to its corner. voxels is 0 where nothing is stored.
struct Spot {
  uint64_t voxels;
  vec3 place;
};

Spot spotNear(uint block, vec3 place) {
  const float block_side = float(kBlockVoxels);
  for (int step = 0; step < 3; ++step) {
    vec3 corner = blockCorner(block);
    uint next = block;
    for (int axis = 0; axis < 3; ++axis) {
      bool below = place[axis] < corner[axis];
      if (!below && place[axis] < corner[axis] + block_side) continue;
      uint neighbour = blockAt(block).neighbours[2 * axis + (below ? 0 : 1)];
      next = next == block || next == kNone ? neighbour : next;
    }
    if (next == block) break;
    if (next == kNone) return Spot(uint64_t(0), vec3(0.0));
    block = next;
  }
  vec3 in_block = clamp(place - blockCorner(block), vec3(0.0), vec3(block_side));
  vec3 local = min(floor(in_block * (1.0 / float(kSubblockSide))), vec3(kBlockSide - 1));
  uint rank = subblockRank(block, uint(dot(local, latticeStrides(vec3(kBlockSide)))));
  if (rank == kNoSubblock) return Spot(uint64_t(0), vec3(0.0));
  return Spot(blockAt(block).voxels + uint64_t(rank) * kSubblockBytes, in_block - local * float(kSubblockSide));
}

bool showsAt(uint block, vec3 place) {
  Spot spot = spotNear(block, place);
  if (spot.voxels == uint64_t(0)) return false;
  float density = densityAt(spot.voxels, spot.place);
  if (!isInRange(density)) return false;
  return kMode == kModeIso || kVoxelType == kVoxelRgba8 || tableSample(density).extinction > 0.0;
}

// Bisection between the sample before, which shows nothing unless the ray begins there, and the one at t, which does.
float crossingBefore(Ray ray, uint block, float k, float t) {
  vec2 before = latticeInterval(ray, k - 1.0);
  float hidden = before.y > before.x ? middleOf(before) : ray.t_min;
  if (before.y <= before.x && showsAt(block, placeAt(ray, ray.t_min))) return ray.t_min;
  float shown = t;
  for (int i = 0; i < 24; ++i) {
    float middle = 0.5 * (hidden + shown);
    if (middle <= hidden || middle >= shown) break;
    if (showsAt(block, placeAt(ray, middle))) {
      shown = middle;
    } else {
      hidden = middle;
    }
  }
  return shown;
}

vec3 litColor(vec3 color, uint64_t voxels, vec3 place, Ray ray) {
  return kLit ? lightColor(color, gradientAt(voxels, place), ray.dir) : color;
}

void hitBefore(Ray ray, uint block, Spot sampled, float k, float t, inout Ink ink) {
  float t_hit = crossingBefore(ray, block, k, t);
  Spot spot = spotNear(block, placeAt(ray, t_hit));
  if (spot.voxels == uint64_t(0)) spot = sampled;
  FieldValue value = fieldAt(spot.voxels, spot.place);
  vec3 color = shadeDensity(value.density, value.color).color;
  hit(litColor(color, spot.voxels, spot.place, ray), placeAt(ray, t_hit), t_hit, ink);
}

void integrateSample(Ray ray, uint block, uint64_t voxels, vec3 corner, float k, vec2 interval, inout Ink ink) {
  float t = middleOf(interval);
  vec3 place = placeAt(ray, t) - corner;
  FieldValue value = fieldAt(voxels, place);
  if (kTestVoxel && !isInRange(value.density)) return;
  Sample s = shadeDensity(value.density, value.color);
  if (!isVisible(value.density, s)) return;
  if (kMode == kModeFirstHit || kMode == kModeIso) {
    hitBefore(ray, block, Spot(voxels, place), k, t, ink);
    return;
  }
  if (kMode == kModeBlend) s.color = litColor(s.color, voxels, place, ray);
  gather(value.density, s, interval.x, interval.y - interval.x, ink);
}

void integrateLinear(Ray ray, uint block, uint64_t voxels, vec3 corner, float t_begin, float t_end, inout Ink ink,
                     inout Work work) {
  float k = latticeIndex(ray, t_begin);
  for (uint i = 0u; i < scene.sample_bound; ++i) {
    vec2 interval = latticeInterval(ray, k);
    float t = middleOf(interval);
    if (t >= t_end) return;
    if (t >= t_begin && interval.y > interval.x) {
      if (kTally) work.voxel_steps += 1u;
      integrateSample(ray, block, voxels, corner, k, interval, ink);
      if (ink.done) return;
    }
    k += 1.0;
  }
  work.loop_bound_hits += 1u;
}

// Integrals of extinction x colour and of extinction over stored value, from the table's start to `stored`; the second
// entry of each pair holds what the first lost in rounding.
void lookUpIntegrals(float stored, out vec4 high, out vec4 low) {
  float index = clamp((stored - scene.table_first) * scene.table_scale, 0.0, float(scene.table_last));
  uint entry = min(uint(index), scene.table_last - 1u);
  float weight = index - float(entry);
  TableArray table = TableArray(scene.integrals);
  // The step to the next entry is small, so adding it to the rest keeps the pair's precision.
  high = table.at[2u * entry];
  low = table.at[2u * entry + 1u] + weight * ((table.at[2u * entry + 2u] - high) + table.at[2u * entry + 3u] -
                                              table.at[2u * entry + 1u]);
}

// The mean colour (weighted by extinction) and mean extinction of a piece whose density goes linearly from front to back
// (Engel, Kraus, Ertl 2001, without attenuation inside the piece).
Sample sampleBetween(float front, float back) {
  if (abs(back - front) * scene.table_scale < 1.0) {
    float middle = 0.5 * (front + back);
    if (!isInRange(middle)) return Sample(vec3(0.0), 0.0);
    return tableSample(middle);
  }
  vec4 high_front, low_front, high_back, low_back;
  lookUpIntegrals(front, high_front, low_front);
  lookUpIntegrals(back, high_back, low_back);
  vec4 integral = ((high_back - high_front) + (low_back - low_front)) / (back - front);
  if (!(integral.a > 0.0)) return Sample(vec3(0.0), 0.0);
  return Sample(integral.rgb / integral.a, integral.a);
}

// The lattice's intervals, cut where the ray enters and leaves the subblock too.
void integratePreIntegrated(Ray ray, uint64_t voxels, vec3 corner, float t_begin, float t_end, inout Ink ink,
                            inout Work work) {
  float k = floor(t_begin / ray.dt);
  float t = t_begin;
  float front = densityAt(voxels, placeAt(ray, t) - corner);
  for (uint i = 0u; i < scene.sample_bound; ++i) {
    float next = min((k + 1.0) * ray.dt, t_end);
    if (next > t) {
      if (kTally) work.voxel_steps += 1u;
      float back = densityAt(voxels, placeAt(ray, next) - corner);
      Sample s = sampleBetween(front, back);
      if (s.extinction > 0.0) {
        s.color = litColor(s.color, voxels, placeAt(ray, 0.5 * (t + next)) - corner, ray);
        gather(back, s, t, next - t, ink);
        if (ink.done) return;
      }
      front = back;
      t = next;
    }
    if (next >= t_end) return;
    k += 1.0;
  }
  work.loop_bound_hits += 1u;
}
