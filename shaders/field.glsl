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

float lerpCorners(float v[8], vec3 weight) {
  vec4 along_x = between(vec4(v[0], v[2], v[4], v[6]), vec4(v[1], v[3], v[5], v[7]), weight.x);
  vec2 along_y = fma(along_x.yw - along_x.xz, vec2(weight.y), along_x.xz);
  return fma(along_y.y - along_y.x, weight.z, along_y.x);
}

// Densities at the corners of a cell: bit 0 of a corner's number is one step along x, bit 1 along y, bit 2 along z.
// rgba8 gives the voxels in `bits` too.
void loadCorners(uint64_t voxels, vec3 cell, out float v[8], out uint bits[8]) {
  if (kOverlaps) {
    float in_row = floor((cell.x + 0.5) * (1.0 / 3.0));
    uint first = wholeNumber(cell.x - 3.0 * in_row);
    uint word = wholeNumber(in_row + dot(cell.yz, vec2(kRowWords, kRowWords * kStride)));
    [[unroll]] for (int row = 0; row < 4; ++row) {
      uint ends = loadOverlapping(voxels, word + uint(kRowWords * ((row & 1) + kStride * (row >> 1))), first);
      const uint mask = kVoxelType == kVoxelU8 ? 255u : 65535u;
      v[2 * row] = float(int(ends & mask));
      v[2 * row + 1] = float(int(ends >> (8 * kVoxelBytes) & mask));
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

// Index-space gradient by central differences over one voxel, which stay inside the apron.
vec3 gradientAt(uint64_t voxels, vec3 place) {
  vec3 gradient;
  for (int axis = 0; axis < 3; ++axis) {
    vec3 shift = vec3(axis == 0 ? 0.5 : 0.0, axis == 1 ? 0.5 : 0.0, axis == 2 ? 0.5 : 0.0);
    gradient[axis] = densityAt(voxels, place + shift) - densityAt(voxels, place - shift);
  }
  return gradient;
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
