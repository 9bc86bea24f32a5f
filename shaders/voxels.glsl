// SPDX-License-Identifier: Apache-2.0
// Voxels of one subblock: x fastest, kStride along each axis; with an apron they begin one voxel below the subblock's first.

BLOCKWALK_DERIVED int kVoxelBytes = kVoxelType == kVoxelU8 ? 1 : (kVoxelType == kVoxelU16 ? 2 : 4);
BLOCKWALK_DERIVED int kSubblockBytes = kStride * kStride * kStride * kVoxelBytes;
BLOCKWALK_DERIVED int kApronOffset = kApron ? 1 + kStride * (1 + kStride) : 0;

vec3 voxelStrides() { return vec3(1.0, float(kStride), float(kStride * kStride)); }

// Density in stored units; rgba8 gives the whole voxel in `bits` too.
float loadDensity(uint64_t voxels, int index, out uint bits) {
  bits = 0u;
  if (kVoxelType == kVoxelRgba8) {
    bits = UintArray(voxels).at[index];
    return float(bits >> 24);
  }
  if (kVoxelType == kVoxelU8) return float(uint(U8Array(voxels).at[index]));
  if (kVoxelType == kVoxelU16) return float(uint(U16Array(voxels).at[index]));
  return F32Array(voxels).at[index];
}

vec3 colorOf(uint bits) { return vec3(bits & 255u, (bits >> 8) & 255u, (bits >> 16) & 255u) * (1.0 / 255.0); }

bool isInRange(int c, float density) {
  return density >= scene.channels[c].density_lo && density <= scene.channels[c].density_hi;
}

// One subblock as each drawn channel has it.
struct SubblockVoxels {
  uint64_t at[kMaxDrawnChannels];  // device addresses
  uint channels;                   // bit c: channel c may show something here
};

// Whether channel c need be looked at. Of one channel the subblock is visited because of it.
bool mayShow(SubblockVoxels voxels, int c) { return kChannels == 1 || !kCull || (voxels.channels >> c & 1u) != 0u; }

SubblockVoxels firstSubblock(uint block) {
  SubblockVoxels voxels;
  forEachChannel(c) voxels.at[c] = channelBlockAt(c, block).voxels;
  voxels.channels = 0u;
  return voxels;
}

// The subblock of rank `rank` in the block of `first`.
SubblockVoxels subblockOfRank(SubblockVoxels first, uint rank, uint channels) {
  SubblockVoxels voxels;
  forEachChannel(c) voxels.at[c] = first.at[c] + uint64_t(rank) * kSubblockBytes;
  voxels.channels = channels;
  return voxels;
}
