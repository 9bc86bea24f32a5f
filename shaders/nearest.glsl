// SPDX-License-Identifier: Apache-2.0
// filter nearest: a subblock is piecewise constant, so the composition over exact path lengths is exact (Max 1995,
// emission-absorption, front to back).

// Coordinates of a subblock's voxel by its index.
vec3 voxelAt(float index) {
  const float stride = float(kStride);
  float z = floor(index / (stride * stride));
  float y = floor((index - z * stride * stride) / stride);
  return vec3(index - stride * (y + stride * z), y, z);
}

void integrateVoxel(Ray ray, uint64_t address, Dda voxels, float t_end, vec3 corner, inout Ink ink) {
  uint bits;
  int index = int(voxels.index) + kApronOffset;
  float density = loadDensity(address, index, bits);
  float length_t = min(voxels.t_exit, t_end) - voxels.t;
  if (!(length_t > 0.0) || (kTestVoxel && !isInRange(density))) return;
  Sample s = shadeDensity(density, colorOf(bits));
  if (!isVisible(density, s)) return;
  if (kLit && kMode != kModeMip && kMode != kModeMean) {
    s.color = lightColor(s.color, voxelGradient(address, index), ray.dir);
  }
  if (kMode == kModeFirstHit || kMode == kModeIso) {
    hit(s.color, corner + voxelAt(voxels.index) + 0.5, voxels.t, ink);
  } else {
    gather(density, s, voxels.t, length_t, ink);
  }
}

void integrateNearest(Ray ray, uint64_t address, vec3 corner, float t_begin, float t_end, inout Ink ink,
                      inout Work work) {
  Dda voxels = enterDda(ray, corner, 1.0, vec3(kSubblockSide), voxelStrides(), t_begin);
  for (int i = 0; i <= 3 * kSubblockSide; ++i) {
    if (kTally) work.voxel_steps += 1u;
    integrateVoxel(ray, address, voxels, t_end, corner, ink);
    if (ink.done || voxels.t_exit >= t_end) return;
    stepDda(ray, 1.0, voxelStrides(), voxels);
  }
  work.loop_bound_hits += 1u;
}
