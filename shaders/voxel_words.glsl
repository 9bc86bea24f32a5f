// SPDX-License-Identifier: Apache-2.0
// Voxels of one subblock: x fastest, kStride along each axis; with an apron they begin one voxel below the subblock's first.
// They are read in words of 32 bits or more and never by the byte: lavapipe gathers bytes into a vector that it packs and
// unpacks at each lane, which costs several times a word.

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer UintArray { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer U64Array { uint64_t at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer F32Array { float at[]; };

BLOCKWALK_DERIVED int kVoxelBytes = kVoxelType == kVoxelU8 ? 1 : (kVoxelType == kVoxelU16 ? 2 : 4);
// With an apron u8 and u16 lie in rows of words that hold four voxels each, of which the last is the next one's first:
// the two ends of an interpolation cell are in one word (renderer/plan/aproned_layout.h).
BLOCKWALK_DERIVED bool kOverlaps = kApron && kVoxelBytes < 4;
BLOCKWALK_DERIVED int kRowWords = kOverlaps ? (kSubblockSide + 3) / 3 : kStride;
BLOCKWALK_DERIVED int kSubblockBytes = kStride * kStride * kRowWords * (kOverlaps ? 4 * kVoxelBytes : kVoxelBytes);
BLOCKWALK_DERIVED int kApronOffset = kApron ? 1 + kStride * (1 + kStride) : 0;

vec3 voxelStrides() { return vec3(1.0, float(kStride), float(kStride * kStride)); }

// The voxels of word `word` from its `first` on: the first in the lowest bits.
uint loadOverlapping(uint64_t voxels, uint word, uint first) {
  if (kVoxelType == kVoxelU8) return UintArray(voxels).at[word] >> (8u * first);
  return uint(U64Array(voxels).at[word] >> (16u * first));
}

// Densities of two of them, from `first` on.
vec2 loadPair(uint64_t voxels, uint word, uint first) {
  const uint mask = kVoxelType == kVoxelU8 ? 255u : 65535u;
  uint ends = loadOverlapping(voxels, word, first);
  return vec2(float(int(ends & mask)), float(int(ends >> (8 * kVoxelBytes) & mask)));
}

uint loadSmall(uint64_t voxels, uint index) {
  const uint mask = kVoxelType == kVoxelU8 ? 255u : 65535u;
  if (kOverlaps) {
    uint row = index / uint(kStride);
    uint x = index - row * uint(kStride);
    uint word = min(x / 3u, uint(kRowWords - 1));
    return loadOverlapping(voxels, row * uint(kRowWords) + word, x - 3u * word) & mask;
  }
  const uint in_word = uint(4 / kVoxelBytes);
  return UintArray(voxels).at[index / in_word] >> (8u * uint(kVoxelBytes) * (index & (in_word - 1u))) & mask;
}

// Density in stored units; `bits` are the whole voxel, for f32 none.
float loadDensity(uint64_t voxels, uint index, out uint bits) {
  bits = 0u;
  if (kVoxelType == kVoxelF32) return F32Array(voxels).at[index];
  bits = kVoxelType == kVoxelRgba8 ? UintArray(voxels).at[index] : loadSmall(voxels, index);
  return float(int(kVoxelType == kVoxelRgba8 ? bits >> 24 : bits));
}

vec3 colorOf(uint bits) { return vec3(ivec3(bits & 255u, (bits >> 8) & 255u, (bits >> 16) & 255u)) * (1.0 / 255.0); }
