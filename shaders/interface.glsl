// SPDX-License-Identifier: Apache-2.0
// Buffers and specialisation constants of the render kernel.
#extension GL_EXT_buffer_reference2 : require
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#ifdef BLOCKWALK_RAY_QUERY
#extension GL_EXT_ray_query : require
#endif

#include "kernel_interface.h"

#define BLOCKWALK_EARLY(id, type, member, constant, initial) layout(constant_id = id) const type constant = initial;
#ifdef BLOCKWALK_GENERAL
// A kernel that makes the late choices when it runs: it draws while one that is specialised for them is made.
layout(push_constant, scalar) uniform Push {
  PushConstants push;
  uint choices[kChoiceCount];
};
#define BLOCKWALK_DERIVED
#define kDrawsLevels true  // one loop over all of them, of which there may be one
#define BLOCKWALK_LATE(id, type, member, constant, initial) type constant = type(choices[id]);
#else
layout(push_constant, scalar) uniform Push { PushConstants push; };
#define BLOCKWALK_DERIVED const
#define kDrawsLevels kMixed
#define BLOCKWALK_LATE BLOCKWALK_EARLY
#endif
BLOCKWALK_CHOICES(BLOCKWALK_EARLY, BLOCKWALK_LATE)

BLOCKWALK_DERIVED int kBlockVoxels = kBlockSide * kSubblockSide;
// What interpolates reads subblocks with their apron (volume/file/apron.h).
BLOCKWALK_DERIVED bool kApron = kFilter == kFilterLinear || kLit;
BLOCKWALK_DERIVED bool kMarches = kFinder == kFinderNone;
// The finder says between which t something may be, not only in which block.
BLOCKWALK_DERIVED bool kFindsIntervals = kFinder == kFinderOctree || kFinder == kFinderClusters || kFinder == kFinderBoundary;
BLOCKWALK_DERIVED bool kTally = kCount || kOutput == kOutputCost;  // count a ray's visits and steps
BLOCKWALK_DERIVED int kStride = kApron ? kSubblockSide + 2 : kSubblockSide;

layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer BlockArray { GpuBlock at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer BoxArray { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer OctreeArray { OctreeNode at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) readonly buffer IntegralArray { vec4 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 16) buffer SumArray { vec4 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer PixelArray { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) writeonly buffer ProbeArray { GpuProbe at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer BitArray { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer NextArray { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) buffer Counters { GpuCounters sums; };
layout(buffer_reference, scalar, buffer_reference_align = 8) readonly buffer Frame { FrameData data; };

#ifdef BLOCKWALK_RAY_QUERY
// Of each level that is drawn.
layout(set = 0, binding = 0) uniform accelerationStructureEXT all_instances[kMaxFarLevels + 1];
#define instances all_instances[kDrawsLevels ? scene.level : 0u]
#endif

// All of the frame, read before the first branch: there lavapipe reads what is the same for all lanes once, behind it once a
// lane. What a kernel does not use is not read.
FrameParams frame;

// What the loops need of the frame and of the level at hand: that which rays walk through, or one that stands in for a
// block (levels.glsl).
struct Scene {
  DrawnChannel channels[kMaxDrawnChannels];
  FinderParts finder;
  uint64_t ancestors;
  vec3 anchor;
  ivec3 block_dims;
  uint level;        // 0: the finest that is drawn
  float transmittance_end;
  uint voxel_shift;  // against the finest level that is drawn
  uint pages;
  float extinction_scale;
  uint sample_bound;
  vec3 gradient_rows[3];
  float transmittance_bound;
  vec3 light;
  // Secondary: whether what is met is shaded, or the point looked for that secondary rays start from; and which share of
  // the ambient and of the key light reaches that.
  bool shades;
  bool seeks_point;
  float ambient_share;
  float key_share;
};

Scene scene;

// Over the channels drawn. An array that is indexed by `c` needs no memory once the loop is unrolled, and of one channel
// nothing is left of it.
#define forEachChannel(c) [[unroll]] for (int c = 0; c < kChannels; ++c)

void loadScene() {
  frame = Frame(push.frame).data.params;
  forEachChannel(c) scene.channels[c] = frame.level.channels[c];
  scene.finder = frame.level.finder;
  scene.ancestors = frame.level.ancestors;
  scene.anchor = vec3(frame.level.anchor);
  scene.block_dims = frame.level.block_dims;
  scene.level = 0u;
  scene.transmittance_end = frame.level.transmittance_end;
  scene.voxel_shift = 0u;
  scene.pages = frame.level.pages;
  scene.extinction_scale = frame.extinction_scale;
  scene.sample_bound = frame.sample_bound;
  scene.gradient_rows = frame.gradient_rows;
  scene.transmittance_bound = frame.transmittance_bound;
  scene.light = frame.light;
  scene.shades = true;
  scene.seeks_point = false;
  scene.ambient_share = scene.key_share = 1.0;
}

// What one ray has done; visits and steps when kTally is on, summed over the frame when kCount is.
struct Work {
  uint queries;
  uint block_visits;
  uint subblock_visits;
  uint voxel_steps;
  uint loop_bound_hits;
};
