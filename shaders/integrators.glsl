// SPDX-License-Identifier: Apache-2.0
// Integrators: what is accumulated between a block's entry and its exit. Nearest filter: a block is piecewise constant, so
// the composition over exact path lengths is exact (Max 1995, emission-absorption, front to back).

struct Ink {
  vec3 color;  // premultiplied
  float transmittance;
  ivec3 voxel;  // first-hit
  float t;
  bool done;
};

struct Sample {
  float density;
  vec3 color;
  float extinction;  // per world unit
};

Sample tableSample(float stored) {
  float index = stored * scene.table_scale + scene.table_offset;
  Sample s;
  s.density = stored;
  vec4 entry;
  if (kVoxelType == kVoxelF32) {
    index = clamp(index, 0.0, float(scene.table_last));
    uint low = min(uint(index), scene.table_last - 1u);
    entry = mix(TableArray(scene.table).at[low], TableArray(scene.table).at[low + 1u], index - float(low));
  } else {
    entry = TableArray(scene.table).at[uint(index)];
  }
  s.color = entry.rgb;
  s.extinction = entry.a;
  return s;
}

float loadDensity(uint64_t voxels, int index, out uint bits) {
  if (kVoxelType == kVoxelRgba8) {
    bits = UintArray(voxels).at[index];
    return float(bits >> 24);
  }
  if (kVoxelType == kVoxelU8) return float(uint(U8Array(voxels).at[index]));
  if (kVoxelType == kVoxelU16) return float(uint(U16Array(voxels).at[index]));
  return F32Array(voxels).at[index];
}

Sample shadeDensity(float density, uint bits) {
  if (kVoxelType == kVoxelRgba8) {
    vec3 color = vec3(bits & 255u, (bits >> 8) & 255u, (bits >> 16) & 255u) * (1.0 / 255.0);
    return Sample(density, color, density * scene.extinction_scale);
  }
  return tableSample(density);
}

// Coordinates of a subblock's voxel by its index.
vec3 voxelAt(float index) {
  const float side = float(kSubblockSide);
  float z = floor(index / (side * side));
  float y = floor((index - z * side * side) / side);
  return vec3(index - side * (y + side * z), y, z);
}

void integrateVoxel(float density, uint bits, Dda voxels, float t_end, vec3 corner, inout Ink ink) {
  float length_t = min(voxels.t_exit, t_end) - voxels.t;
  if (!(length_t > 0.0)) return;
  if (kTestVoxel && !(density >= scene.density_lo && density <= scene.density_hi)) return;
  Sample s = shadeDensity(density, bits);
  if (kMode == kModeFirstHit) {
    if (kVoxelType != kVoxelRgba8 && s.extinction <= 0.0) return;
    ink.color = s.color;
    ink.transmittance = 0.0;
    ink.voxel = ivec3(corner + voxelAt(voxels.index) + scene.anchor);
    ink.t = voxels.t;
    ink.done = true;
  } else {
    float weight = ink.transmittance * opacityOfDepth(s.extinction * length_t);
    ink.color += weight * s.color;
    ink.transmittance -= weight;
    ink.done = ink.transmittance < kTransmittanceBound;
  }
}

void integrateSubblock(Ray ray, uint64_t voxels_address, vec3 corner, float t_begin, float t_end, inout Ink ink,
                       inout Work work) {
  const vec3 count = vec3(kSubblockSide);
  Dda voxels = enterDda(ray, corner, 1.0, count, t_begin);
  for (int i = 0; i <= 3 * kSubblockSide; ++i) {
    uint bits = 0u;
    float density = loadDensity(voxels_address, int(voxels.index), bits);
    if (kCount) work.voxel_steps += 1u;
    integrateVoxel(density, bits, voxels, t_end, corner, ink);
    if (ink.done || voxels.t_exit >= t_end) return;
    stepDda(ray, 1.0, latticeStrides(count), voxels);
  }
  work.loop_bound_hits += 1u;
}

void integrateBlock(Ray ray, uint block, float t_begin, float t_end, inout Ink ink, inout Work work) {
  const uint64_t subblock_bytes = uint64_t(kSubblockSide * kSubblockSide * kSubblockSide) *
                                  uint64_t(kVoxelType == kVoxelU8 ? 1 : (kVoxelType == kVoxelU16 ? 2 : 4));
  const vec3 count = vec3(kBlockSide);
  const float side = float(kSubblockSide);
  uint64_t block_voxels = blockAt(block).voxels;
  uint first_subblock = blockAt(block).first_subblock;
  Dda subblocks = enterDda(ray, blockCorner(block), side, count, t_begin);
  for (int i = 0; i <= 3 * kBlockSide; ++i) {
    uint local = uint(subblocks.index);
    uint rank = (blockAt(block).indices[local >> 2] >> ((local & 3u) * 8u)) & 255u;
    float t_exit = min(subblocks.t_exit, t_end);
    if (rank != kNoSubblock && t_exit > subblocks.t && !subblockIsCulled(first_subblock + rank)) {
      if (kCount) work.subblock_visits += 1u;
      integrateSubblock(ray, block_voxels + uint64_t(rank) * subblock_bytes, subblocks.far - side * ray.forward,
                        subblocks.t, t_exit, ink, work);
    }
    if (ink.done || subblocks.t_exit >= t_end) return;
    stepDda(ray, side, latticeStrides(count), subblocks);
  }
  work.loop_bound_hits += 1u;
}
