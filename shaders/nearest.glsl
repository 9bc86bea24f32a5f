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

// What channel c has in a voxel that the ray crosses over `length_t`: added to the mixture or, mip and mean, to the ink.
// Whether there is anything to see.
bool addVoxel(int c, Ray ray, uint64_t address, int index, float t, float length_t, inout Sample mixture,
              inout Ink ink) {
  uint bits;
  float density = loadDensity(address, index, bits);
  if (!(length_t > 0.0) || (kTestVoxel && !isInRange(c, density))) return false;
  Sample s = shadeDensity(c, density, colorOf(bits));
  if (!isVisible(density, s)) return false;
  if (kGathersDensities) {
    gatherDensity(c, density, s.color, t, length_t, ink);
  } else {
    if (kLit) s.color = lightColor(c, s.color, voxelGradient(address, index), ray.dir);
    mixIn(s, mixture);
  }
  return true;
}

void integrateVoxel(Ray ray, SubblockVoxels subblock, Dda voxels, float t_end, vec3 corner, inout Ink ink) {
  int index = int(voxels.index) + kApronOffset;
  float length_t = min(voxels.t_exit, t_end) - voxels.t;
  Sample mixture = Sample(vec3(0.0), 0.0);
  bool visible = false;
  forEachChannel(c, {
    if (mayShow(subblock, c)) {
      bool adds = addVoxel(c, ray, subblock.at[c], index, voxels.t, length_t, mixture, ink);
      visible = visible || adds;
    }
  })
  if (kGathersDensities || !visible) return;
  if (kMode == kModeFirstHit || kMode == kModeIso) {
    hit(mixture.color, corner + voxelAt(voxels.index) + 0.5, voxels.t, ink);
  } else {
    gather(mixture, voxels.t, length_t, ink);
  }
}

void integrateNearest(Ray ray, SubblockVoxels subblock, vec3 corner, float t_begin, float t_end, inout Ink ink,
                      inout Work work) {
  Dda voxels = enterDda(ray, corner, 1.0, vec3(kSubblockSide), voxelStrides(), t_begin);
  for (int i = 0; i <= 3 * kSubblockSide; ++i) {
    if (kTally) work.voxel_steps += 1u;
    integrateVoxel(ray, subblock, voxels, t_end, corner, ink);
    if (ink.done || voxels.t_exit >= t_end) return;
    stepDda(ray, 1.0, voxelStrides(), voxels);
  }
  work.loop_bound_hits += 1u;
}
