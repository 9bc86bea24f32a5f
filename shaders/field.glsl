// SPDX-License-Identifier: Apache-2.0
// The trilinear field inside one subblock, from its voxels and their apron (docs/integration.md, "The field"). `place` is
// relative to the subblock's corner, in voxels, 0..kSubblockSide.

struct FieldValue {
  float density;
  vec3 color;  // rgba8
};

// Lower corner of the interpolation cell, counted from the apron's first voxel, and the place inside the cell.
vec3 cellAt(vec3 place, out vec3 weight) {
  vec3 cell = clamp(floor(place + 0.5), vec3(0.0), vec3(kSubblockSide));
  weight = place + 0.5 - cell;
  return cell;
}

// Not mix(): between equal values this gives just that value, so that a plateau has one density and no gradient.
vec4 between(vec4 a, vec4 b, float weight) { return fma(b - a, vec4(weight), a); }
float between(float a, float b, float weight) { return fma(b - a, weight, a); }

float lerpCorners(float v[8], vec3 weight) {
  vec4 along_x = between(vec4(v[0], v[2], v[4], v[6]), vec4(v[1], v[3], v[5], v[7]), weight.x);
  vec2 along_y = fma(along_x.yw - along_x.xz, vec2(weight.y), along_x.xz);
  return between(along_y.x, along_y.y, weight.z);
}

// Where the two voxels from `at` on lie that are beside each other along x: in which word, and from which voxel of it on.
struct PairPlace {
  uint word;
  uint first;
};

PairPlace pairPlace(vec3 at) {
  float in_row = floor((at.x + 0.5) * (1.0 / 3.0));
  return PairPlace(wholeNumber(in_row + dot(at.yz, vec2(kRowWords, kRowWords * kStride))), wholeNumber(at.x - 3.0 * in_row));
}

// Densities at the corners of a cell: bit 0 of a corner's number is one step along x, bit 1 along y, bit 2 along z.
// rgba8 gives the voxels in `bits` too.
void loadCorners(uint64_t voxels, vec3 cell, out float v[8], out uint bits[8]) {
  if (kOverlaps) {
    PairPlace place = pairPlace(cell);
    [[unroll]] for (int row = 0; row < 4; ++row) {
      vec2 ends = loadPair(voxels, place.word + uint(kRowWords * ((row & 1) + kStride * (row >> 1))), place.first);
      v[2 * row] = ends.x;
      v[2 * row + 1] = ends.y;
    }
    return;
  }
  uint index = wholeNumber(dot(cell, voxelStrides()));
  [[unroll]] for (int i = 0; i < 8; ++i) {
    v[i] = loadDensity(voxels, index + uint((i & 1) + kStride * ((i >> 1 & 1) + kStride * (i >> 2))), bits[i]);
  }
}

float densityAt(uint64_t voxels, vec3 place) {
  vec3 weight;
  vec3 cell = cellAt(place, weight);
  float v[8];
  uint bits[8];
  loadCorners(voxels, cell, v, bits);
  return lerpCorners(v, weight);
}

// a and b are not negative, so that nothing cancels: small values keep their ratios.
vec4 mixed(vec4 a, vec4 b, float weight) { return a * (1.0 - weight) + b * weight; }

FieldValue fieldAt(uint64_t voxels, vec3 place) {
  if (kVoxelType != kVoxelRgba8) return FieldValue(densityAt(voxels, place), vec3(0.0));
  vec3 weight;
  vec3 cell = cellAt(place, weight);
  float density[8];
  uint bits[8];
  loadCorners(voxels, cell, density, bits);
  vec4 v[8];
  for (int i = 0; i < 8; ++i) v[i] = vec4(colorOf(bits[i]) * density[i], density[i]);
  vec4 low = mixed(mixed(v[0], v[1], weight.x), mixed(v[2], v[3], weight.x), weight.y);
  vec4 high = mixed(mixed(v[4], v[5], weight.x), mixed(v[6], v[7], weight.x), weight.y);
  vec4 value = mixed(low, high, weight.z);
  return FieldValue(lerpCorners(density, weight), value.a > 0.0 ? value.rgb / value.a : vec3(0.0));
}

// mode minip: the voxel of channel c that a place lies in, interpolated with those of the cell's others that are in the
// range. Whether it is itself: what is out of the range is never mixed in.
bool visibleFieldAt(int c, uint64_t voxels, vec3 place, out FieldValue value) {
  vec3 weight;
  vec3 cell = cellAt(place, weight);
  float density[8];
  uint bits[8];
  loadCorners(voxels, cell, density, bits);
  int nearest = (weight.x < 0.5 ? 0 : 1) + (weight.y < 0.5 ? 0 : 2) + (weight.z < 0.5 ? 0 : 4);
  float own = density[0];
  [[unroll]] for (int i = 1; i < 8; ++i) own = i == nearest ? density[i] : own;
  float weights = 0.0;
  float above = 0.0;  // the voxel's own, so that equal ones give just their value
  vec4 product = vec4(0.0);
  [[unroll]] for (int i = 0; i < 8; ++i) {
    vec3 side = mix(1.0 - weight, weight, vec3(i & 1, i >> 1 & 1, i >> 2));
    float share = isInRange(c, density[i]) ? side.x * side.y * side.z : 0.0;
    weights += share;
    above += share > 0.0 ? share * (density[i] - own) : 0.0;
    if (kVoxelType == kVoxelRgba8) product += share * density[i] * vec4(colorOf(bits[i]), 1.0);
  }
  value = FieldValue(own + above / weights, product.a > 0.0 ? product.rgb / product.a : vec3(0.0));
  return isInRange(c, own);
}

// Of the row with y and z of `at`, all counted from the apron's first voxel: two voxels from x on.
vec2 rowPair(uint64_t voxels, vec3 at) {
  if (kOverlaps) {
    PairPlace place = pairPlace(at);
    return loadPair(voxels, place.word, place.first);
  }
  uint index = wholeNumber(dot(at, voxelStrides()));
  uint bits;
  return vec2(loadDensity(voxels, index, bits), loadDensity(voxels, index + 1u, bits));
}

// Three voxels: where they are not in one word the last is the second of the next.
vec3 rowTriple(uint64_t voxels, vec3 at) {
  if (kOverlaps) {
    PairPlace place = pairPlace(at);
    bool last = place.first == 2u;
    vec2 next = loadPair(voxels, last ? place.word + 1u : place.word, last ? 1u : place.first + 2u);
    return vec3(loadPair(voxels, place.word, place.first), next.x);
  }
  uint bits;
  return vec3(rowPair(voxels, at), loadDensity(voxels, wholeNumber(dot(at, voxelStrides())) + 2u, bits));
}

// Between the last two of three minus between the first two.
float slopeOf(float a, float b, float c, float weight) { return between(b, c, weight) - between(a, b, weight); }

// Index-space gradient by central differences over one voxel, which stay inside the apron. The six samples of the field have 48
// corners, but lie in 8 rows: four that go through the cell at `place`, of three voxels along x, and beside these two along y
// and two along z, of two voxels.
vec3 gradientAt(uint64_t voxels, vec3 place) {
  vec3 weight;
  vec3 cell = cellAt(place, weight);
  // Along each axis, the cell of the sample half a voxel before `place`; at the far end the one before that, its weight 1.
  vec3 low = clamp(floor(place), vec3(0.0), vec3(kSubblockSide - 1));
  vec3 low_weight = place - low;   // of both samples
  bvec3 lower = equal(cell, low);  // whether the cell at `place` is that of the lower sample, else of the upper
  vec3 beside = mix(low, low + 2.0, lower);
  float through[4], slope_x[4], beside_y[2], beside_z[2];
  [[unroll]] for (int i = 0; i < 4; ++i) {
    vec3 row = rowTriple(voxels, vec3(low.x, cell.y + float(i & 1), cell.z + float(i >> 1)));
    vec2 ends = lower.x ? row.xy : row.yz;
    through[i] = between(ends.x, ends.y, weight.x);
    slope_x[i] = slopeOf(row.x, row.y, row.z, low_weight.x);
  }
  [[unroll]] for (int i = 0; i < 2; ++i) {
    vec2 y_row = rowPair(voxels, vec3(cell.x, beside.y, cell.z + float(i)));
    vec2 z_row = rowPair(voxels, vec3(cell.x, cell.y + float(i), beside.z));
    beside_y[i] = between(y_row.x, y_row.y, weight.x);
    beside_z[i] = between(z_row.x, z_row.y, weight.x);
  }
  float slope_y[2], slope_z[2];
  [[unroll]] for (int i = 0; i < 2; ++i) {
    slope_y[i] = lower.y ? slopeOf(through[2 * i], through[2 * i + 1], beside_y[i], low_weight.y)
                         : slopeOf(beside_y[i], through[2 * i], through[2 * i + 1], low_weight.y);
    slope_z[i] = lower.z ? slopeOf(through[i], through[i + 2], beside_z[i], low_weight.z)
                         : slopeOf(beside_z[i], through[i], through[i + 2], low_weight.z);
  }
  return vec3(between(between(slope_x[0], slope_x[1], weight.y), between(slope_x[2], slope_x[3], weight.y), weight.z),
              between(slope_y[0], slope_y[1], weight.z), between(slope_z[0], slope_z[1], weight.y));
}

// The same for a voxel of filter nearest: over its two neighbours along each axis.
vec3 voxelGradient(uint64_t voxels, uint index) {
  vec3 gradient;
  for (int axis = 0; axis < 3; ++axis) {
    uint stride = uint(axis == 0 ? 1 : (axis == 1 ? kStride : kStride * kStride));
    uint bits;
    gradient[axis] = 0.5 * (loadDensity(voxels, index + stride, bits) - loadDensity(voxels, index - stride, bits));
  }
  return gradient;
}
