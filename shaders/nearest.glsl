// SPDX-License-Identifier: Apache-2.0
// filter nearest: a subblock is piecewise constant, so the composition over exact path lengths is exact (Max 1995,
// emission-absorption, front to back).

// Coordinates of a subblock's voxel by its index.
vec3 voxelAt(float index) {
  const float stride = float(kSubblockSide);
  float z = floor(index / (stride * stride));
  float y = floor((index - z * stride * stride) / stride);
  return vec3(index - stride * (y + stride * z), y, z);
}

// Sides are powers of two, so that the bits of an index without an apron are the coordinates.
BLOCKWALK_DERIVED uint kSideBits = kSubblockSide == 4 ? 2u : (kSubblockSide == 8 ? 3u : 4u);

// Where in memory the voxel lies.
uint voxelIndex(float index) {
  uint i = wholeNumber(index);
  if (!kApron) return i;
  uint y = i >> kSideBits & uint(kSubblockSide - 1);
  uint z = i >> (2u * kSideBits);
  return uint(kApronOffset) + (i & uint(kSubblockSide - 1)) + uint(kStride) * (y + uint(kStride) * z);
}

// A voxel that the ray crosses over `length_t`, in the colour and extinction of its visible channels together.
void showVoxel(Sample s, Dda voxels, float length_t, vec3 corner, inout Ink ink) {
  if (kMode == kModeFirstHit || kMode == kModeIso) {
    hit(s.color, corner + voxelAt(voxels.index) + 0.5, voxels.t, ink);
  } else {
    gather(s, voxels.t, length_t, ink);
  }
}

// What channel c shows of a voxel: gathered, a single channel's at once, or added to the mixture. At once, because a colour
// that leaves a branch which only some rays take is stored under a mask: that costs lavapipe a sixth of the frame.
void addVoxel(int c, Ray ray, uint64_t address, Dda voxels, float length_t, vec3 corner, inout Sample mixture,
              inout Ink ink) {
  uint bits;
  uint index = voxelIndex(voxels.index);
  float density = loadDensity(address, index, bits);
  if (!(length_t > 0.0) || (kTestVoxel && !isInRange(c, density))) return;
  Sample s = shadeVoxel(c, density, bits);
  if (!isVisible(density, s)) return;
  noteDensity(density, ink);
  if (kGathersDensities) {
    gatherDensity(c, density, s.color, voxels.t, length_t, ink);
    return;
  }
  if (isShaded()) s.color = lightColor(c, s.color, voxelGradient(address, index), ray.dir);
  if (kChannels == 1) {
    showVoxel(s, voxels, length_t, corner, ink);
  } else {
    mixIn(s, mixture);
  }
}

void integrateVoxel(Ray ray, SubblockVoxels subblock, Dda voxels, float t_end, vec3 corner, inout Ink ink) {
  float length_t = min(voxels.t_exit, t_end) - voxels.t;
  Sample mixture = Sample(vec3(0.0), 0.0);
  forEachChannel(c) {
    if (mayShow(subblock, c)) addVoxel(c, ray, subblock.at[c], voxels, length_t, corner, mixture, ink);
  }
  if (kChannels > 1 && mixture.extinction > 0.0) showVoxel(mixture, voxels, length_t, corner, ink);
}

// Where each voxel is gathered without a branch (kStraight). The next one is loaded before the one at hand is shaded, so that
// its way from memory is not waited for.
void integrateStraight(Ray ray, uint64_t address, Dda voxels, float t_end, inout Ink ink, inout Work work) {
  const vec3 strides = latticeStrides(vec3(kSubblockSide));
  uint bits;
  float density = loadDensity(address, voxelIndex(voxels.index), bits);
  for (int i = 0; i <= 3 * kSubblockSide; ++i) {
    if (kTally) work.voxel_steps += 1u;
    bool ends = voxels.t_exit >= t_end;
    float t = voxels.t;
    float length_t = max(min(voxels.t_exit, t_end) - t, 0.0);
    bool visible = !kTestVoxel || isInRange(0, density);
    float shown = visible ? density : scene.channels[0].density_lo;  // NaN is no index of a table
    uint shown_bits = bits;
    if (!ends) {
      stepDda(ray, 1.0, strides, voxels);
      density = loadDensity(address, voxelIndex(voxels.index), bits);
    }
    Sample s = shadeVoxel(0, shown, shown_bits);
    s.extinction = visible ? s.extinction : 0.0;
    gather(s, t, length_t, ink);
    if (ends) return;
  }
  work.loop_bound_hits += 1u;
}

void integrateNearest(Ray ray, SubblockVoxels subblock, vec3 corner, float t_begin, float t_end, inout Ink ink,
                      inout Work work) {
  const vec3 strides = latticeStrides(vec3(kSubblockSide));
  Dda voxels = enterDda(ray, corner, 1.0, vec3(kSubblockSide), strides, t_begin);
  if (kStraight) {
    integrateStraight(ray, subblock.at[0], voxels, t_end, ink, work);
    return;
  }
  for (int i = 0; i <= 3 * kSubblockSide; ++i) {
    if (kTally) work.voxel_steps += 1u;
    integrateVoxel(ray, subblock, voxels, t_end, corner, ink);
    if (ink.done || voxels.t_exit >= t_end) return;
    stepDda(ray, 1.0, strides, voxels);
  }
  work.loop_bound_hits += 1u;
}
