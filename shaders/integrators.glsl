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
  float index = stored * frame.table_scale + frame.table_offset;
  Sample s;
  s.density = stored;
  vec4 entry;
  if (kVoxelType == kVoxelF32) {
    index = clamp(index, 0.0, float(frame.table_last));
    uint low = min(uint(index), frame.table_last - 1u);
    entry = mix(TableArray(frame.table).at[low], TableArray(frame.table).at[low + 1u], index - float(low));
  } else {
    entry = TableArray(frame.table).at[uint(index)];
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
    return Sample(density, color, density * frame.extinction_scale);
  }
  return tableSample(density);
}

void integrateVoxel(float density, uint bits, Dda voxels, float t_end, vec3 corner, inout Ink ink) {
  float length_t = min(voxels.t_exit, t_end) - voxels.t;
  if (!(length_t > 0.0)) return;
  if (kTestVoxel && !(density >= frame.density_lo && density <= frame.density_hi)) return;
  Sample s = shadeDensity(density, bits);
  if (kMode == kModeFirstHit) {
    if (kVoxelType != kVoxelRgba8 && s.extinction <= 0.0) return;
    ink.color = s.color;
    ink.transmittance = 0.0;
    ink.voxel = ivec3(corner) + voxels.cell + frame.anchor;
    ink.t = voxels.t;
    ink.done = true;
  } else {
    float opacity = opacityOfDepth(s.extinction * length_t);
    ink.color += (ink.transmittance * opacity) * s.color;
    ink.transmittance -= ink.transmittance * opacity;
    ink.done = ink.transmittance < kTransmittanceBound;
  }
}

void integrateSubblock(Ray ray, uint64_t voxels_address, vec3 corner, float t_begin, float t_end, inout Ink ink,
                       inout Work work) {
  Dda voxels = enterDda(ray, corner, 1.0, ivec3(kSubblockSide), t_begin);
  for (int i = 0; i <= 3 * kSubblockSide; ++i) {
    uint bits = 0u;
    int index = voxels.cell.x + kSubblockSide * (voxels.cell.y + kSubblockSide * voxels.cell.z);
    float density = loadDensity(voxels_address, index, bits);
    if (kCount) work.voxel_steps += 1u;
    integrateVoxel(density, bits, voxels, t_end, corner, ink);
    if (ink.done || voxels.t_exit >= t_end) return;
    stepDda(ray, 1.0, voxels);
    if (!insideLattice(voxels.cell, ivec3(kSubblockSide))) return;
  }
  work.loop_bound_hits += 1u;
}

void integrateBlock(Ray ray, uint block, float t_begin, float t_end, inout Ink ink, inout Work work) {
  const uint64_t subblock_bytes = uint64_t(kSubblockSide * kSubblockSide * kSubblockSide) *
                                  uint64_t(kVoxelType == kVoxelU8 ? 1 : (kVoxelType == kVoxelU16 ? 2 : 4));
  vec3 corner = blockCorner(block);
  Dda subblocks = enterDda(ray, corner, float(kSubblockSide), ivec3(kBlockSide), t_begin);
  for (int i = 0; i <= 3 * kBlockSide; ++i) {
    uint local = uint(subblocks.cell.x + kBlockSide * (subblocks.cell.y + kBlockSide * subblocks.cell.z));
    uint rank = (blockAt(block).indices[local >> 2] >> ((local & 3u) * 8u)) & 255u;
    float t_exit = min(subblocks.t_exit, t_end);
    if (rank != kNoSubblock && t_exit > subblocks.t && !subblockIsCulled(blockAt(block).first_subblock + rank)) {
      if (kCount) work.subblock_visits += 1u;
      integrateSubblock(ray, blockAt(block).voxels + uint64_t(rank) * subblock_bytes,
                        corner + vec3(subblocks.cell * kSubblockSide), subblocks.t, t_exit, ink, work);
    }
    if (ink.done || subblocks.t_exit >= t_end) return;
    stepDda(ray, float(kSubblockSide), subblocks);
    if (!insideLattice(subblocks.cell, ivec3(kBlockSide))) return;
  }
  work.loop_bound_hits += 1u;
}
