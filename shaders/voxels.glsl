// SPDX-License-Identifier: Apache-2.0
// Voxels of one subblock: x fastest, kStride along each axis; with an apron they begin one voxel below the subblock's first.
// They are read in words of 32 bits or more and never by the byte: lavapipe gathers bytes into a vector that it packs and
// unpacks at each lane, which costs several times a word.

BLOCKWALK_DERIVED int kVoxelBytes = kVoxelType == kVoxelU8 ? 1 : (kVoxelType == kVoxelU16 ? 2 : 4);
// With an apron u8 and u16 lie in rows of words that hold four voxels each, of which the last is the next one's first:
// the two ends of an interpolation cell are in one word (renderer/subblock_layout.h).
BLOCKWALK_DERIVED bool kOverlaps = kApron && kVoxelBytes < 4;
BLOCKWALK_DERIVED int kRowWords = kOverlaps ? (kSubblockSide + 3) / 3 : kStride;
BLOCKWALK_DERIVED int kSubblockBytes = kStride * kStride * kRowWords * (kOverlaps ? 4 * kVoxelBytes : kVoxelBytes);
BLOCKWALK_DERIVED int kApronOffset = kApron ? 1 + kStride * (1 + kStride) : 0;

vec3 voxelStrides() { return vec3(1.0, float(kStride), float(kStride * kStride)); }

// The voxels of word `word` from its `first` on: the first in the lowest bits.
uint loadOverlapping(uint64_t voxels, int word, int first) {
  if (kVoxelType == kVoxelU8) return UintArray(voxels).at[word] >> (8 * first);
  return uint(U64Array(voxels).at[word] >> (16 * first));
}

uint loadSmall(uint64_t voxels, int index) {
  const uint mask = kVoxelType == kVoxelU8 ? 255u : 65535u;
  if (kOverlaps) {
    int row = index / kStride;
    int x = index - row * kStride;
    int word = min(x / 3, kRowWords - 1);
    return loadOverlapping(voxels, row * kRowWords + word, x - 3 * word) & mask;
  }
  const int in_word = 4 / kVoxelBytes;
  return UintArray(voxels).at[index / in_word] >> (8 * kVoxelBytes * (index & (in_word - 1))) & mask;
}

// Density in stored units; rgba8 gives the whole voxel in `bits` too.
float loadDensity(uint64_t voxels, int index, out uint bits) {
  bits = 0u;
  if (kVoxelType == kVoxelRgba8) {
    bits = UintArray(voxels).at[index];
    return float(int(bits >> 24));
  }
  if (kVoxelBytes < 4) return float(int(loadSmall(voxels, index)));
  return F32Array(voxels).at[index];
}

vec3 colorOf(uint bits) { return vec3(ivec3(bits & 255u, (bits >> 8) & 255u, (bits >> 16) & 255u)) * (1.0 / 255.0); }

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
