// SPDX-License-Identifier: Apache-2.0
// filter linear: samples of the trilinear field in the middles of the intervals of one lattice along the ray
// (docs/integration.md, "Samples"). A sample belongs to the subblock in which its t lies, whoever found it.

// Interval k of the lattice, cut to the ray.
vec2 latticeInterval(Ray ray, float k) {
  return vec2(lesser(greater(k * ray.dt, ray.t_min), ray.t_max), lesser(greater((k + 1.0) * ray.dt, ray.t_min), ray.t_max));
}

float middleOf(vec2 interval) { return 0.5 * (interval.x + interval.y); }

// The first interval whose middle is at or after t, or the one before it.
float latticeIndex(Ray ray, float t) { return floor(t / ray.dt - 0.5); }

vec3 placeAt(Ray ray, float t) { return fma(ray.dir, vec3(t), ray.start); }

// The subblock at a place near `block`, and the place relative to its corner.
struct Spot {
  uint64_t voxels[kMaxDrawnChannels];  // the first is 0 where nothing is stored
  vec3 place;
};

Spot spotNear(uint block, vec3 place) {
  Spot spot;
  spot.voxels[0] = uint64_t(0);
  spot.place = vec3(0.0);
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
    if (next == kNone) return spot;
    block = next;
  }
  if (kPaged && scene.pages != kNone && wantVoxels(block, 1.0)) return spot;
  vec3 in_block = clamp(place - blockCorner(block), vec3(0.0), vec3(block_side));
  vec3 local = min(floor(in_block * (1.0 / float(kSubblockSide))), vec3(kBlockSide - 1));
  uint rank = subblockRank(block, wholeNumber(dot(local, latticeStrides(vec3(kBlockSide)))));
  if (rank == kNoSubblock) return spot;
  spot.voxels = subblockOfRank(firstSubblock(block), rank).at;
  spot.place = in_block - local * float(kSubblockSide);
  return spot;
}

bool channelShowsAt(int c, uint64_t voxels, vec3 place) {
  float density = densityAt(voxels, place);
  if (!isInRange(c, density)) return false;
  return kMode == kModeIso || kVoxelType == kVoxelRgba8 || tableSample(c, density).extinction > 0.0;
}

bool showsAt(uint block, vec3 place) {
  Spot spot = spotNear(block, place);
  if (spot.voxels[0] == uint64_t(0)) return false;
  bool shows = false;
  forEachChannel(c) {
    if (!shows) shows = channelShowsAt(c, spot.voxels[c], spot.place);
  }
  return shows;
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

vec3 litColor(int c, vec3 color, uint64_t voxels, vec3 place, Ray ray) {
  return isShaded() ? lightColor(c, color, gradientAt(voxels, place), ray.dir) : color;
}

// Adds what channel c shows of a place to the mixture. A single channel is known to be visible there: its density may lie
// a rounding beside the bound that the place was found by.
void addHit(int c, Ray ray, uint64_t voxels, vec3 place, inout Sample mixture) {
  FieldValue value = fieldAt(voxels, place);
  if (kChannels > 1 && !isInRange(c, value.density)) return;
  Sample s = shadeDensity(c, value.density, value.color);
  if (kChannels > 1 && !isVisible(value.density, s)) return;
  s.color = litColor(c, s.color, voxels, place, ray);
  mixIn(s, mixture);
}

Sample hitOn(Ray ray, Spot spot) {
  Sample mixture = Sample(vec3(0.0), 0.0);
  forEachChannel(c) addHit(c, ray, spot.voxels[c], spot.place, mixture);
  return mixture;
}

// The hit between the sample before and the one of interval k at t, which shows `sampled` at the spot.
void hitBefore(Ray ray, uint block, Spot spot, Sample sampled, float k, float t, inout Ink ink) {
  float t_hit = crossingBefore(ray, block, k, t);
  Spot nearer = spotNear(block, placeAt(ray, t_hit));
  if (nearer.voxels[0] != uint64_t(0)) spot = nearer;
  if (kOutput == kOutputValue) ink.density[0] = densityAt(spot.voxels[0], spot.place);
  Sample s = hitOn(ray, spot);
  if (kChannels > 1 && !(s.extinction > 0.0)) s = sampled;  // hidden by a rounding
  hit(s.color, placeAt(ray, t_hit), t_hit, ink);
}

// What channel c shows of a sample: gathered, a single channel's at once, or added to the mixture. Whether it is visible.
bool addSample(int c, Ray ray, uint64_t voxels, vec3 place, vec2 interval, inout Sample mixture, inout Ink ink) {
  float length_t = interval.y - interval.x;
  FieldValue value;
  if (kMode == kModeMinip) {
    if (!visibleFieldAt(c, voxels, place, value)) return false;
    gatherDensity(c, value.density, value.color, interval.x, length_t, ink);
    return true;
  }
  value = fieldAt(voxels, place);
  if (kStraight && kVoxelType == kVoxelRgba8) {  // of scalars the branch spares a look into the table
    Sample s = shadeDensity(c, value.density, value.color);
    s.extinction = !kTestVoxel || isInRange(c, value.density) ? s.extinction : 0.0;
    gather(s, interval.x, length_t, ink);
    return true;
  }
  if (kTestVoxel && !isInRange(c, value.density)) return false;
  Sample s = shadeDensity(c, value.density, value.color);
  if (!isVisible(value.density, s)) return false;
  noteDensity(value.density, ink);
  if (kGathersDensities) {
    gatherDensity(c, value.density, s.color, interval.x, length_t, ink);
    return true;
  }
  if (kMode == kModeBlend || kChannels > 1) s.color = litColor(c, s.color, voxels, place, ray);
  if (kMode == kModeBlend && kChannels == 1) {
    gather(s, interval.x, length_t, ink);
  } else {
    mixIn(s, mixture);
  }
  return true;
}

void integrateSample(Ray ray, uint block, SubblockVoxels voxels, vec3 corner, float k, vec2 interval, inout Ink ink) {
  float t = middleOf(interval);
  vec3 place = placeAt(ray, t) - corner;
  Sample mixture = Sample(vec3(0.0), 0.0);
  bool visible = false;
  forEachChannel(c) {
    if (mayShow(voxels, c)) {
      bool adds = addSample(c, ray, voxels.at[c], place, interval, mixture, ink);
      visible = visible || adds;
    }
  }
  if (kMode == kModeFirstHit || kMode == kModeIso) {
    if (visible) hitBefore(ray, block, Spot(voxels.at, place), mixture, k, t, ink);
  } else if (kMode == kModeBlend && kChannels > 1 && visible) {
    gather(mixture, interval.x, interval.y - interval.x, ink);
  }
}

// The first interval whose middle is at or after t. That of the last one, which the ray's end cuts, may lie before it too.
float firstInterval(Ray ray, float t) {
  float k = latticeIndex(ray, t);
  k += middleOf(latticeInterval(ray, k)) < t ? 1.0 : 0.0;
  return middleOf(latticeInterval(ray, k)) < t ? k + 1.0 : k;
}

void integrateLinear(Ray ray, uint block, SubblockVoxels voxels, vec3 corner, float t_begin, float t_end, inout Ink ink,
                     inout Work work) {
  float k = firstInterval(ray, t_begin);
  for (uint i = 0u; i < scene.sample_bound; ++i) {
    vec2 interval = latticeInterval(ray, k);
    if (middleOf(interval) >= t_end || (!kStraight && ink.done)) return;
    if (kStraight || interval.y > interval.x) {
      if (kTally && interval.y > interval.x) work.voxel_steps += 1u;
      integrateSample(ray, block, voxels, corner, k, interval, ink);
    }
    k += 1.0;
  }
  work.loop_bound_hits += 1u;
}
