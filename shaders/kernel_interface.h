// SPDX-License-Identifier: Apache-2.0
// What C++ and GLSL share: structs in scalar layout, specialisation ids, and small pure functions that CPU tests run
// too.
//
// "Relative index space" is the index space of the level drawn, minus FrameParams::anchor (whole voxels). Planes
// between voxels are whole numbers there, so they are exact in a float, and a ray's own numbers stay small near what it
// looks at.
#ifndef BLOCKWALK_KERNEL_INTERFACE_H
#define BLOCKWALK_KERNEL_INTERFACE_H

#ifdef __cplusplus
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#define BLOCKWALK_CONST constexpr
namespace blockwalk::gpu {
using glm::ivec2;
using glm::ivec3;
using glm::uvec2;
using glm::vec2;
using glm::vec3;
using glm::vec4;
using std::exp2;
using std::uint64_t;
using uint = std::uint32_t;
#define BLOCKWALK_FUNCTION inline
#else
#define BLOCKWALK_CONST const
#define BLOCKWALK_FUNCTION
#endif

// Values of the specialisation constants.
BLOCKWALK_CONST uint kVoxelRgba8 = 1;
BLOCKWALK_CONST uint kVoxelU8 = 2;
BLOCKWALK_CONST uint kVoxelU16 = 3;
BLOCKWALK_CONST uint kVoxelF32 = 4;
BLOCKWALK_CONST uint kModeBlend = 0;
BLOCKWALK_CONST uint kModeFirstHit = 1;
BLOCKWALK_CONST uint kModeBlocks = 2;
BLOCKWALK_CONST uint kModeMip = 3;
BLOCKWALK_CONST uint kModeMean = 4;
BLOCKWALK_CONST uint kModeIso = 5;
BLOCKWALK_CONST uint kModeMinip = 6;
BLOCKWALK_CONST uint kModeAttenuatedMip = 7;
BLOCKWALK_CONST uint kFilterNearest = 0;
BLOCKWALK_CONST uint kFilterLinear = 1;
BLOCKWALK_CONST uint kClassificationPost = 0;
BLOCKWALK_CONST uint kClassificationPreIntegrated = 1;
BLOCKWALK_CONST uint kOutputColor = 0;
BLOCKWALK_CONST uint kOutputPoint = 1;  // t of the point shown: depth and position are made of it
BLOCKWALK_CONST uint kOutputCost = 2;
BLOCKWALK_CONST uint kOutputQueries = 3;
BLOCKWALK_CONST uint kOutputMesh = 4;
BLOCKWALK_CONST uint kOutputValue = 5;        // the density of the point shown, or what is gathered of densities
BLOCKWALK_CONST uint kNoValue = 0x7fc00000u;  // a float that is no number
// Requests::file, shells, transmittance, and how many ranks of blocks the latter two tell apart.
BLOCKWALK_CONST uint kRequestsFile = 0;
BLOCKWALK_CONST uint kRequestsShells = 1;
BLOCKWALK_CONST uint kRequestsTransmittance = 2;
BLOCKWALK_CONST uint kRequestRanks = 8;
BLOCKWALK_CONST uint kFinderQuery = 1;
BLOCKWALK_CONST uint kFinderGrid = 2;
BLOCKWALK_CONST uint kFinderClusters = 3;
BLOCKWALK_CONST uint kFinderBoundary = 4;
BLOCKWALK_CONST uint kFinderOctree = 5;
BLOCKWALK_CONST uint kFinderNone = 6;

// The kernel's choices, once for all: (constant_id, GLSL type, member of KernelKey, GLSL constant, default). Of them
// are made the specialisation constants (interface.glsl), the words that a general kernel reads, and KernelKey
// (renderer/plan/kernel_key.h). Ids count from 0 without a gap. A general kernel makes the late ones when it runs; the
// early ones are those that would make it several times as long.
// clang-format off
#define BLOCKWALK_CHOICES(early, late) \
  early(0, uint, voxel_type, kVoxelType, 1u) \
  late(1, uint, mode, kMode, 0u) \
  early(2, uint, finder, kFinder, 2u) \
  late(3, bool, walk, kWalk, true) \
  late(4, bool, cull, kCull, true)                           /* only where something stored cannot be seen */ \
  late(5, bool, range_open, kRangeOpen, false)               /* all non-empty voxels are in the range, and drawn */ \
  late(6, bool, test_voxel, kTestVoxel, true)                /* stored voxels may be out, and not by their extinction */ \
  late(7, bool, clip, kClip, false)                          /* some plane cuts the volume */ \
  late(8, bool, opaque_background, kOpaqueBackground, true) \
  early(9, int, subblock_side, kSubblockSide, 8) \
  early(10, int, block_side, kBlockSide, 6) \
  early(11, uint, filter, kFilter, 0u) \
  late(12, bool, lit, kLit, false) \
  early(13, uint, classification, kClassification, 0u) \
  late(14, uint, output, kOutput, 0u) \
  late(15, bool, antialias, kAntialias, false)               /* several samples a pixel, a dispatch each */ \
  early(16, int, channels, kChannels, 1)                     /* drawn */ \
  late(17, bool, count, kCount, true) \
  late(18, bool, probe, kProbe, false) \
  late(19, bool, fine_table, kFineTable, false)              /* entries are so close that the nearest will do */ \
  early(20, bool, paged, kPaged, false)                      /* voxels of some blocks may be absent */ \
  late(21, bool, mixed, kMixed, false)                       /* what is far away is drawn of coarser levels */ \
  late(22, bool, secondary, kSecondary, false)               /* light that does not reach what is seen is taken away */ \
  late(23, bool, lens, kLens, false)                         /* rays come from all of a lens */
// clang-format on
// One term of a sum. NOLINTNEXTLINE(bugprone-macro-parentheses)
#define BLOCKWALK_COUNT_CHOICE(id, type, member, constant, initial) +1
BLOCKWALK_CONST int kChoiceCount = 0 BLOCKWALK_CHOICES(BLOCKWALK_COUNT_CHOICE, BLOCKWALK_COUNT_CHOICE);

BLOCKWALK_CONST uint kNone = 0xffffffffu;
BLOCKWALK_CONST uint kNoSubblock = 255u;   // in GpuBlock::indices
BLOCKWALK_CONST int kGridTileSide = 8;     // blocks
BLOCKWALK_CONST int kMaxOctreeDepth = 16;  // 65536 voxels in leaves of one
// States of macrocells.
BLOCKWALK_CONST uint kMacrocellCalm = 0;    // not active, nor beside one that is
BLOCKWALK_CONST uint kMacrocellNear = 1;    // beside an active one
BLOCKWALK_CONST uint kMacrocellActive = 2;  // something in it may be seen
BLOCKWALK_CONST uint kOctreeStored = 256u;  // in OctreeNode::mask
BLOCKWALK_CONST int kMaxClipPlanes = 12;    // a clip box's and a view's own
BLOCKWALK_CONST int kMaxDrawnChannels = 4;
BLOCKWALK_CONST int kMaxFarLevels = 3;                     // of a frame, beside the finest that is drawn
BLOCKWALK_CONST int kMaxCoarseLevels = kMaxFarLevels + 1;  // and what stands in where voxels are absent
BLOCKWALK_CONST uint kOcclusionRays = 8u;                  // of a sample, in as many directions
BLOCKWALK_CONST int kGroupSide = 8;                        // pixels; a workgroup is 8x8 of them
// Output point: t where there is nothing to show. Bounds of the traversal are of this size where a ray stands still.
BLOCKWALK_CONST float kHugeT = 1e30f;

// Derin et al. 2021, section 2: one block as the kernel sees it.
struct GpuBlock {
  uint64_t voxels;      // device address of the first subblock's voxels; the block's subblocks are consecutive
  ivec3 origin;         // first voxel, level index space
  uint first_subblock;  // in the level's GpuSubblock array
  float density_min;    // over non-empty voxels, stored units
  float density_max;
  uint range_mask;
  uint neighbours[6];  // -x +x -y +y -z +z: block index or kNone
  uint indices[54];    // 216 bytes: rank of local subblock x + side * (y + side * z), or kNoSubblock
  uint padding;
};

struct GpuSubblock {
  float density_min;
  float density_max;
  uint range_mask;
};

// Lukic 2017: the eight children of a node are one run, octant x + 2 y + 4 z.
struct OctreeNode {
  uint first;  // of an inner node's children; of a leaf: its block
  uint mask;   // 0 where nothing is stored, else kOctreeStored and the range mask of all below
};

// Counters are 64 bits as two words, low first, summed over the rays of a frame.
struct GpuCounters {
  uint queries[2];
  uint block_visits[2];
  uint subblock_visits[2];
  uint voxel_steps[2];
  uint loop_bound_hits[2];
  uint non_finite[2];
};

struct GpuProbe {
  ivec3 voxel;
  uint blocks;
  float t;
};

// A channel that is drawn. All of a volume have the same blocks and subblocks in the same order: origins, neighbours
// and indices are equal, ranges, masks and voxels are each channel's own.
struct DrawnChannel {
  uint64_t blocks;     // GpuBlock[]
  uint64_t quarters;   // uvec2[]: of each subblock the quarters that may show something (shaders/visible_quarters.comp)
  uint64_t table;      // uvec2[]: extinction per world unit as a float's bits, packed colour
  uint64_t empty;      // finder none: voxels of a subblock that is empty everywhere
  uint64_t integrals;  // vec4[2][]: of table over stored value: extinction x colour, extinction; then their roundings
  float density_lo;    // effective range, stored units, inclusive
  float density_hi;
  uint range_mask;
  float table_first;  // table index = (stored - table_first) * table_scale
  float table_scale;
  float table_last;
  float light_strength;  // light is full where the world gradient times this reaches 1
  float range_lo;        // attenuated-mip: the view's range as it stands, stored units
  float range_width;
  uint padding;
};

// What finders look in, of a level.
struct FinderParts {
  uint64_t grid_tiles;        // uint[]: number of the tile's 512 places, or kNone
  uint64_t grid_blocks;       // uint[][512]: block index or kNone
  uint64_t octree;            // OctreeNode[], the root first
  uint64_t macrocell_states;  // uint8_t[] of macrocells, x fastest
  uint64_t boxes;             // vec3[2][]: corners of clusters, index space of the level
  ivec3 tile_dims;            // tiles of kGridTileSide^3 blocks
  ivec3 macrocell_dims;       // macrocells of the level's box
  int octree_depth;           // the root's side is 2^octree_depth leaves
  float macrocell_voxels;     // their side
};

// A level that rays walk through, or that stands in where voxels of one are absent.
struct FrameLevel {
  DrawnChannel channels[kMaxDrawnChannels];
  FinderParts finder;
  uint64_t ancestors;       // uint[]: for each block the one of the level that stands in which covers it, or kNone
  ivec3 anchor;             // voxel
  uint shift;               // 2^shift of the finest level's voxels are one of this
  ivec3 block_dims;         // blocks of the level's box
  uint pages;               // where its blocks begin in FrameParams::wanted, in words; kNone: all its voxels are there
  float depth_end;          // from `point` on, before the eye; behind it the next level is drawn
  float transmittance_end;  // and from where a ray has less left
};

struct FrameParams {
  FrameLevel level;       // the finest that is drawn
  uint far_count;         // of those that are drawn farther away: the first in FrameData::coarse
  uint stand_in;          // paged: in FrameData::coarse
  uint64_t wanted;        // uint[]: bit i of word i / 32 is set where a ray comes to block i; level by level
  uint64_t next_samples;  // uint[], the band's: the sample that a pixel is to be drawn with next
  uint fresh_sample;      // drawn of all pixels, whatever is next of them; kNone: no sample is
  uint accepts;           // not 0: what came to absent blocks counts too
  uint requests;          // in which order blocks are asked for: kRequests...
  uint rank_words;        // of the blocks of each rank in `wanted`; 0: all are of one
  uint64_t
      pixels;     // uint[], the band's: straight rgba8, the bits of a float (output point), or a count (cost, queries)
  uint64_t sums;  // vec4[], the band's: premultiplied colours of the samples so far, added
  uint64_t probes;    // GpuProbe[], the band's
  uint64_t counters;  // GpuCounters

  // The ray through pixel (px, py), with x = (2 px + 1) / width - 1 and y likewise downwards from +1, but for where
  // samplePlace() takes the place of the pixel's centre:
  // point = point_center + x point_right + y point_up, direction = (dir_center + x dir_right + y dir_up) / length,
  // length = sqrt(1 + (x half_width)^2 + (y half_height)^2), both in relative index space; t is in world units and 0 at
  // `point`, which lies at depth `point_depth` before the eye. Near the volume, so that a far eye costs no precision.
  vec3 point_center;
  vec3 point_right;
  vec3 point_up;
  vec3 dir_center;
  vec3 dir_right;
  vec3 dir_up;
  float half_width;  // of the direction: 0 for an orthographic camera
  float half_height;
  float point_depth;

  vec3 box_min;  // the volume's box, relative index space
  vec3 box_max;
  vec4 clip_planes[kMaxClipPlanes];  // inside where dot(xyz, p) + w >= 0, relative index space; unit normals
  ivec2 size;                        // pixels
  uint clip_plane_count;

  float extinction_scale;  // rgba8: extinction per world unit and density step
  vec4 background;         // premultiplied

  float step_voxels;  // filter linear: distance of samples
  uint sample_bound;  // no ray has more samples in one subblock
  vec3
      gradient_rows[3];  // world gradient = (dot(row 0, g), dot(row 1, g), dot(row 2, g)) of the index-space gradient g
  float transmittance_bound;  // a ray of which less is left stops
  vec3 light;                 // index-space direction whose world direction is the unit vector to the key light
  float attenuation;          // attenuated-mip: per world unit at the upper end of a channel's range
  vec4 lights;                // ambient, head and key light, highlight
  uint shadow;                // 1: the key light comes through the volume; else 0
  float occlusion_reach;      // world units: so far around it something takes the ambient light away; 0: nowhere
  float lens_radius;          // world units
  float focus_depth;          // before the eye
};

struct FrameData {
  FrameParams params;
  // Mixed: those that are drawn farther away, the finest first. Paged: one stands in where the voxels of a block are
  // absent; its own are all there. Read by their addresses.
  FrameLevel coarse[kMaxCoarseLevels];
};

// For shaders/visible_quarters.comp: one channel of a level, and the stored densities that can be seen.
struct VisibleQuartersPush {
  uint64_t blocks;    // GpuBlock[]
  uint64_t masks;     // GpuSubblock[]
  uint64_t quarters;  // uint[2][], written
  float density_lo;
  float density_hi;
  uint first_block;  // of this dispatch
  uint block_count;  // of the level
  uint subblock_count;
  uint padding;
};

struct PushConstants {
  uint64_t frame;  // FrameParams
  int row_begin;   // first row of the band
  int row_count;
  uint sample_index;  // of the dispatch; each packs the mean of those so far
  uint row_stride;    // of workgroups: row i of a dispatch draws row (i x stride) mod rows of the band
};

// Jarzynski & Olano 2020, "Hash Functions for GPU Rendering": pcg2d.
BLOCKWALK_FUNCTION uvec2 pixelSeed(uvec2 v) {
  v = v * 1664525u + 1013904223u;
  v.x += v.y * 1664525u;
  v.y += v.x * 1664525u;
  v = v ^ (v >> 16u);
  v.x += v.y * 1664525u;
  v.y += v.x * 1664525u;
  return v ^ (v >> 16u);
}

// Where in its pixel a sample lies, [0, 1) to the right and downwards: the sequence R2 (Roberts 2018), whose steps are
// 1/g and 1/g^2 with g^3 = g + 1, begun at the pixel's seed; in steps of 2^-32, so that all machines agree.
BLOCKWALK_FUNCTION vec2 samplePlace(ivec2 pixel, uint index) {
  uvec2 place = pixelSeed(uvec2(pixel)) + uvec2(3242174889u, 2447445414u) * index;
  return vec2(place >> 8u) * (1.0f / 16777216.0f);
}

// Of a sample on a lens, a disc of radius 1: the fractional parts of multiples of the roots of 2 and 3 (Richtmyer
// 1951), begun at another seed than the place in the pixel.
BLOCKWALK_FUNCTION vec2 lensUnits(ivec2 pixel, uint index) {
  uvec2 place = pixelSeed(uvec2(pixel) + uvec2(40503u, 30011u)) + uvec2(1779033703u, 3144134277u) * index;
  return vec2(place >> 8u) * (1.0f / 16777216.0f);
}

// Of direction `index` around a point, as evenly as R2 is: [0, 1) of the axis, and of the turn about it.
BLOCKWALK_FUNCTION vec2 directionUnits(uint index) {
  uvec2 place = uvec2(3242174889u, 2447445414u) * index + uvec2(2147483648u);
  return vec2(place >> 8u) * (1.0f / 16777216.0f);
}

// Opacity of an optical depth: -expm1(-x), right to a few ulp of a float for every x >= 0. GLSL has no expm1, so small
// depths take the Taylor series of 1 - exp(-x) to the fifth order (error below x^6/720).
BLOCKWALK_FUNCTION float opacityOfDepth(float depth) {
  float small =
      depth * (1.0f - depth * (0.5f - depth * (0.16666667f - depth * (0.041666668f - depth * 0.0083333333f))));
  float large = 1.0f - exp2(-1.44269504f * depth);
  return depth < 0.0625f ? small : large;
}

// A table's colours: 11 bits of red, 11 of green, 10 of blue. The rounding is an eighth of an 8-bit step at most.
BLOCKWALK_FUNCTION vec3 unpackColor(uint bits) {
  // Through signed integers: few CPUs convert unsigned ones.
  return vec3(float(int(bits >> 21u)) * (1.0f / 2047.0f), float(int((bits >> 10u) & 2047u)) * (1.0f / 2047.0f),
              float(int(bits & 1023u)) * (1.0f / 1023.0f));
}

#ifdef __cplusplus
static_assert(sizeof(GpuBlock) == 8 + 12 + 4 + 8 + 4 + 24 + 216 + 4);
static_assert(offsetof(GpuBlock, neighbours) == 36 && offsetof(GpuBlock, indices) == 60);
static_assert(sizeof(GpuSubblock) == 12 && sizeof(GpuProbe) == 20 && sizeof(GpuCounters) == 48);
static_assert(sizeof(OctreeNode) == 8);
static_assert(sizeof(DrawnChannel) == 80);
static_assert(sizeof(FinderParts) == 72 && sizeof(FrameLevel) == 440 && offsetof(FrameLevel, ancestors) == 392);
static_assert(offsetof(FrameParams, far_count) == 440 && offsetof(FrameParams, pixels) == 480);
static_assert(offsetof(FrameParams, point_center) == 512 && offsetof(FrameParams, half_width) == 584);
static_assert(offsetof(FrameParams, clip_planes) == 620 && offsetof(FrameParams, size) == 812);
static_assert(offsetof(FrameParams, extinction_scale) == 824 && offsetof(FrameParams, background) == 828);
static_assert(offsetof(FrameParams, gradient_rows) == 852 && offsetof(FrameParams, light) == 892);
static_assert(offsetof(FrameParams, lights) == 908 && offsetof(FrameParams, lens_radius) == 932);
static_assert(sizeof(FrameParams) == 944 && offsetof(FrameData, coarse) == 944);
static_assert(sizeof(PushConstants) == 24 && sizeof(VisibleQuartersPush) == 48);
}  // namespace blockwalk::gpu
#endif
#endif
