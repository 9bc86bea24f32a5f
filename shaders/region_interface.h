// SPDX-License-Identifier: Apache-2.0
// What C++ and the kernels that build the finders' active regions share (docs/finders.md): push constants, in scalar
// layout.
#ifndef BLOCKWALK_REGION_INTERFACE_H
#define BLOCKWALK_REGION_INTERFACE_H

#include "kernel_interface.h"

#ifdef __cplusplus
namespace blockwalk::gpu {
#endif

BLOCKWALK_CONST int kRegionGroupSide = 4;  // a workgroup is 4^3 macrocells or faces
BLOCKWALK_CONST uint kFaceVertices = 6;    // two triangles
BLOCKWALK_CONST uint kFaceFloats = 18;

// macrocells.comp: the range of a channel in every macrocell.
struct MacrocellPush {
  uint64_t blocks;      // GpuBlock[]
  uint64_t subblocks;   // GpuSubblock[]
  uint64_t grid_tiles;  // as in FrameParams
  uint64_t grid_blocks;
  uint64_t ranges;    // GpuSubblock[], x fastest: written
  uint64_t occupied;  // uint: macrocells with something in them, added to
  ivec3 tile_dims;
  ivec3 macrocell_dims;
  int macrocell_voxels;  // a multiple of subblock_side
  int subblock_side;
  int block_side;
};

struct ClassifiedChannel {
  uint64_t ranges;     // GpuSubblock[] of the macrocells
  uint64_t intervals;  // vec2[]: densities that can be seen, inclusive, ascending
  uint interval_count;
  uint range_mask;
};

// classify.comp: which macrocells some channel may be seen in.
struct ClassifyPush {
  ClassifiedChannel channels[kMaxDrawnChannels];
  uint64_t states;  // uint8_t[], x fastest: kMacrocellActive or kMacrocellCalm
  uint channel_count;
  ivec3 macrocell_dims;
};

// surround.comp: which of the others touch an active one.
struct SurroundPush {
  uint64_t states;      // of classify.comp
  uint64_t surrounded;  // uint8_t[]: written, with kMacrocellNear too
  uint64_t active_count;
  ivec3 macrocell_dims;
};

// boundary_faces.comp: two triangles for every face between an active macrocell and one that is not.
struct BoundaryPush {
  uint64_t states;      // of classify.comp
  uint64_t vertices;    // float[kFaceFloats][]: written
  uint64_t face_count;  // uint: added to, also beyond the capacity
  uint capacity;        // faces
  ivec3 macrocell_dims;
  float macrocell_voxels;
  float slack;  // voxels
};

#ifdef __cplusplus
static_assert(sizeof(MacrocellPush) == 88 && sizeof(ClassifiedChannel) == 24);
static_assert(sizeof(ClassifyPush) == 120 && sizeof(SurroundPush) == 40 && sizeof(BoundaryPush) == 48);
}  // namespace blockwalk::gpu
#endif
#endif
