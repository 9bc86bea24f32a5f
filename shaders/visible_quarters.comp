#version 460
// SPDX-License-Identifier: Apache-2.0
// Which quarters of each subblock may show something of one channel in a density range: 64 bits a subblock, x fastest.
// A quarter is a cube of a quarter of the side. Where voxels are interpolated its values are those of its voxels and the
// one-voxel ring around it. A workgroup has a block, an invocation half a subblock.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_buffer_reference2 : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_control_flow_attributes : require
#include "kernel_interface.h"

#define BLOCKWALK_DERIVED const
layout(constant_id = 0) const uint kVoxelType = kVoxelU8;
layout(constant_id = 1) const int kSubblockSide = 8;
layout(constant_id = 2) const bool kApron = false;
BLOCKWALK_DERIVED int kStride = kApron ? kSubblockSide + 2 : kSubblockSide;

layout(push_constant, scalar) uniform Push { VisibleQuartersPush push; };

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer BlockArray { GpuBlock at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer SubblockArray { GpuSubblock at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer HalfArray { uint at[]; };
#include "voxel_words.glsl"

layout(local_size_x = 64) in;

const int kQuarterSide = kSubblockSide / 4;
const int kReach = kApron ? kQuarterSide + 2 : kQuarterSide;  // voxels along an axis that a quarter's values come from

// Of rows of voxels, bit x: some voxel x is at or above the range's lower end; at or below its upper end.
struct RowBits {
  uint above;
  uint below;
};

void addVoxel(float density, int x, inout RowBits row) {
  bool above = density >= push.density_lo;
  bool below = density <= push.density_hi;
  // Between voxels the field takes every value; without interpolation one voxel must be both.
  row.above |= uint(kApron ? above : above && below) << x;
  row.below |= uint(kApron ? below : above && below) << x;
}

void addRow(uint64_t voxels, int number, inout RowBits row) {
  if (kVoxelBytes == 4) {
    uint bits;
    for (int x = 0; x < kStride; ++x) addVoxel(loadDensity(voxels, uint(number * kStride + x), bits), x, row);
    return;
  }
  const int voxels_a_word = kOverlaps ? 4 : 4 / kVoxelBytes;
  const int words = kOverlaps ? kRowWords : kStride / voxels_a_word;
  const int step = kOverlaps ? 3 : voxels_a_word;
  for (int i = 0; i < words; ++i) {
    uint64_t word = kOverlaps && kVoxelBytes == 2 ? U64Array(voxels).at[number * words + i]
                                                  : uint64_t(UintArray(voxels).at[number * words + i]);
    uvec2 halves = unpackUint2x32(word);
    [[unroll]] for (int j = 0; j < voxels_a_word; ++j) {
      uint bits = halves[j * kVoxelBytes / 4] >> (8 * (j * kVoxelBytes & 3)) & (kVoxelBytes == 1 ? 255u : 65535u);
      addVoxel(float(int(bits)), step * i + j, row);
    }
  }
}

// 16 bits: the quarters whose lowest voxels lie at `z_first`.
uint layerOfQuarters(uint64_t voxels, int z_first) {
  RowBits rows[4];
  [[unroll]] for (int quarter = 0; quarter < 4; ++quarter) rows[quarter] = RowBits(0u, 0u);
  for (int y = 0; y < kStride; ++y) {
    RowBits row = RowBits(0u, 0u);
    for (int z = z_first; z < z_first + kReach; ++z) addRow(voxels, y + kStride * z, row);
    [[unroll]] for (int quarter = 0; quarter < 4; ++quarter) {
      bool within = y >= kQuarterSide * quarter && y < kQuarterSide * quarter + kReach;
      rows[quarter].above |= within ? row.above : 0u;
      rows[quarter].below |= within ? row.below : 0u;
    }
  }
  uint quarters = 0u;
  [[unroll]] for (int i = 0; i < 16; ++i) {
    uint own = ((1u << kReach) - 1u) << (kQuarterSide * (i & 3));
    if ((rows[i >> 2].above & own) != 0u && (rows[i >> 2].below & own) != 0u) quarters |= 1u << i;
  }
  return quarters;
}

void main() {
  uint number = push.first_block + gl_WorkGroupID.x;
  uint64_t voxels = BlockArray(push.blocks).at[number].voxels;
  uint first = BlockArray(push.blocks).at[number].first_subblock;
  uint end = number + 1u < push.block_count ? BlockArray(push.blocks).at[number + 1u].first_subblock : push.subblock_count;
  for (uint i = gl_LocalInvocationIndex; i < 2u * (end - first); i += gl_WorkGroupSize.x) {
    uint rank = i >> 1;
    GpuSubblock range = SubblockArray(push.masks).at[first + rank];
    uint quarters = 0u;
    bool meets = range.density_max >= push.density_lo && range.density_min <= push.density_hi;
    if (meets && voxels == uint64_t(0)) {
      quarters = 0xffffffffu;  // not known until the voxels are there
    } else if (meets) {
      uint64_t at = voxels + uint64_t(rank) * kSubblockBytes;
      int z_first = 2 * kQuarterSide * int(i & 1u);
      quarters = layerOfQuarters(at, z_first) | layerOfQuarters(at, z_first + kQuarterSide) << 16;
    }
    HalfArray(push.quarters).at[2u * first + i] = quarters;
  }
}
