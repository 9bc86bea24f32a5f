#version 460
// SPDX-License-Identifier: Apache-2.0
// The render kernel: find a block, integrate inside it, walk to the next (Derin et al. 2021, 2.1 to 2.3).
#extension GL_GOOGLE_include_directive : require
#include "interface.glsl"
#include "voxel_words.glsl"
#include "ray.glsl"
#include "blocks.glsl"
#include "levels.glsl"
#include "pages.glsl"
#include "octree.glsl"
#include "finders.glsl"
#include "subblocks.glsl"
#include "field.glsl"
#include "shading.glsl"
#include "ink.glsl"
#include "nearest.glsl"
#include "linear.glsl"
#include "pre_integrated.glsl"
#include "march.glsl"
#include "integrators.glsl"
#include "edges.glsl"
#include "secondary.glsl"

layout(local_size_x = 64) in;

// Where what was integrated of a block ends, which the ray leaves at t_exit: its last interval may reach beyond that.
float endOfBlock(Ray ray, float t_exit) {
  return kFilter == kFilterLinear && kClassification == kClassificationPost ? latticeInterval(ray, firstInterval(ray, t_exit)).x : t_exit;
}

// Steps of traverse(): blocks, among them those that a walk passes through at an edge, and ends of spans.
int traversalBound() {
  int blocks = scene.block_dims.x + scene.block_dims.y + scene.block_dims.z;
  int bound = (kFinder == kFinderOctree ? 2 + kBlockSide : 2) * blocks + 8;
  if (kFinder == kFinderOctree || !kFindsIntervals) return bound;
  return bound + scene.finder.macrocell_dims.x + scene.finder.macrocell_dims.y + scene.finder.macrocell_dims.z;
}

// Along the part of a ray that is drawn of one level (levels.glsl), which may end sooner.
uint traverse(inout Ray ray, inout Ink ink, inout Work work) {
  uint crossed = 0u;
  uint block = kNone;
  float t = ray.t_min;
  vec2 span = vec2(ray.t_min, kFindsIntervals ? ray.t_min : ray.t_max);
  int bound = traversalBound();
  for (int i = 0; i < bound; ++i) {
    if (t >= ray.t_max) return crossed;
    vec3 corner;
    if (kMarches) {
      block = blockAtT(ray, t, corner);
    } else {
      if (block == kNone) block = findBlock(ray, t, span, work);
      if (block == kNone) return crossed;
      corner = blockCorner(block);
    }
    vec2 interval = cubeInterval(ray, corner, float(kBlockVoxels));
    float t_begin = max(interval.x, kFindsIntervals ? max(span.x, t) : t);
    float t_end = min(interval.y, kFindsIntervals ? min(span.y, ray.t_max) : ray.t_max);
    if (kOutput == kOutputMesh && ink.edge < 0.0) ink.edge = edgeCover(ray, kFindsIntervals ? span.x : max(interval.x, ray.t_min));
    if (kMode == kModeBlocks) {
      // Without a branch: what is culled is what does not count.
      bool crosses = t_end > t_begin;
      bool meets = (!kMarches || block != kNone) && (kRangeOpen || blockMeetsRange(block));
      crossed += crosses && meets ? 1u : 0u;
      if (kTally) work.block_visits += crosses && (meets || !kCull) ? 1u : 0u;
    } else if (t_end > t_begin && (kMarches || !blockIsCulled(block))) {
      if (kTally) work.block_visits += 1u;
      if (kPaged) {  // every kernel knows whether it is: of the two calls it has one
        Ray local = ray;
        uint holder = block;
        bool stands_in = standIn(ink.transmittance, local, holder, corner, t_begin, t_end);
        if (t_end > t_begin) integrateBlock(local, holder, corner, t_begin, t_end, ink, work);
        if (!kMixed || stands_in) standBack();  // of one level it costs less than the branch
      } else {
        integrateBlock(ray, block, corner, t_begin, t_end, ink, work);
      }
      if (ink.done) return crossed;
      if (kDrawsLevels && ink.transmittance < scene.transmittance_end) ray.t_max = min(ray.t_max, endOfBlock(ray, interval.y));
    }
    bool goes_on = !kFindsIntervals || interval.y < span.y;
    t = max(t, goes_on ? interval.y : span.y);
    block = kWalk && goes_on ? walkFrom(ray, block, interval.y) : kNone;
  }
  work.loop_bound_hits += 1u;
  return crossed;
}

// Counts as a heat map: black, violet, red, orange, white; half way at 16 blocks.
vec3 heat(uint count) {
  const vec3 stops[5] = vec3[](vec3(0.0), vec3(0.34, 0.06, 0.43), vec3(0.86, 0.25, 0.25), vec3(0.99, 0.65, 0.12),
                               vec3(0.99, 1.0, 0.85));
  float position = 4.0 * (1.0 - exp2(-float(count) / 16.0));
  int low = min(int(position), 3);
  return mix(stops[low], stops[low + 1], position - float(low));
}

// Over the background, premultiplied.
vec4 colorOver(Ink ink) {
  return vec4(ink.color + ink.transmittance * frame.background.rgb,
              kOpaqueBackground ? 1.0 : 1.0 - ink.transmittance * (1.0 - frame.background.a));
}

uint packColor(vec4 color) {
  if (!kOpaqueBackground) color.rgb = color.a > 0.0 ? color.rgb / color.a : vec3(0.0);
  uvec4 bytes = uvec4(clamp(color, 0.0, 1.0) * 255.0 + 0.5);
  return bytes.r | (bytes.g << 8) | (bytes.b << 16) | (bytes.a << 24);
}

// The mean of the samples so far, each as it would be displayed alone.
vec4 meanColor(vec4 color, uint at) {
  color.rgb = clamp(color.rgb, vec3(0.0), vec3(color.a));
  if (push.sample_index > 0u) color += SumArray(frame.sums).at[at];
  SumArray(frame.sums).at[at] = color;
  return color / float(push.sample_index + 1u);
}

// What a pixel's word holds, and whether every number behind it is finite.
uint pixelWord(Ink ink, Work work, uint at, out bool finite) {
  if (kOutput == kOutputPoint) {
    finite = !isnan(ink.t) && !isinf(ink.t);
    return floatBitsToUint(ink.t);
  }
  if (kOutput == kOutputValue) {
    bool shows = kGathersDensities ? hasGathered(ink, 0) : ink.t != kHugeT;
    float value = shownDensity(ink, 0);
    finite = !shows || !(isnan(value) || isinf(value));
    return shows ? floatBitsToUint(value) : kNoValue;
  }
  if (kOutput == kOutputQueries) {
    finite = true;
    return work.queries;
  }
  if (kOutput == kOutputCost) {
    finite = true;
    return work.voxel_steps + work.block_visits + work.subblock_visits;
  }
  finite = !any(isnan(ink.color)) && !any(isinf(ink.color)) && !isnan(ink.transmittance);
  vec4 color = colorOver(ink);
  return packColor(kAntialias ? meanColor(color, at) : color);
}

#define addToCounter(member, value)                                                        \
  {                                                                                        \
    uint sum = subgroupAdd(value);                                                         \
    if (subgroupElect() && sum != 0u) {                                                    \
      uint before = atomicAdd(Counters(frame.counters).sums.member[0], sum);               \
      if (before + sum < before) atomicAdd(Counters(frame.counters).sums.member[1], 1u);   \
    }                                                                                      \
  }

void main() {
  loadScene();
  // A subgroup of 8 lanes is 4x2 pixels, one of 16 lanes 4x4, one of 32 8x4, the workgroup 8x8.
  uint lane = gl_LocalInvocationIndex & 15u;
  uint tile = gl_LocalInvocationIndex >> 4;
  ivec2 local = ivec2((tile & 1u) * 4u + (lane & 3u), (tile >> 1) * 4u + (lane >> 2));
  uint row = (gl_WorkGroupID.y * push.row_stride) % gl_NumWorkGroups.y;
  ivec2 in_band = ivec2(gl_WorkGroupID.x, row) * kGroupSide + local;
  if (in_band.x >= frame.size.x || in_band.y >= push.row_count) return;

  uint at = uint(in_band.x + frame.size.x * in_band.y);
  if (kPaged && !isNext(at)) return;
  ivec2 pixel = in_band + ivec2(0, push.row_begin);
  vec2 lens = kLens && kAntialias ? onDisc(lensUnits(pixel, push.sample_index)) : vec2(0.0);
  Ray eye_ray = makeRay(pixel, kAntialias ? samplePlace(pixel, push.sample_index) : vec2(0.5), lens);
  Ray ray;
  Ink ink;
  Work work = Work(0u, 0u, 0u, 0u, 0u);
  uint crossed = 0u;
  Passes passes = firstPass();
  for (uint pass = 0u; pass < passes.count; ++pass) {
    ray = rayOfPass(passes, pass, eye_ray);
    ink = freshInk();
    if (kDrawsLevels) {  // of the two calls every kernel has one
      float t_begin = ray.t_min;
      for (uint level = 0u; level <= frame.far_count && !ink.done; ++level) {
        Ray part = partOfLevel(ray, level, t_begin);
        enterLevel(level, part);
        if (ink.transmittance < scene.transmittance_end) part.t_max = part.t_min;  // of the next one at once
        crossed = traverse(part, ink, work);  // blocks are counted of one level
        t_begin = part.t_max;
      }
    } else {
      crossed = traverse(ray, ink, work);
    }
    notePass(pass, ray, ink, passes);
    if (!kSecondary) break;
  }
  if (kGathersDensities) mixDensities(ink);
  if (kMode == kModeBlocks && crossed > 0u) {
    ink.color = heat(crossed);
    ink.transmittance = 0.0;
  }
  if (kOutput == kOutputMesh && ink.edge > 0.0) drawEdge(ink);

  if (kPaged && !isAccepted(at)) return;
  bool finite;
  PixelArray(frame.pixels).at[at] = pixelWord(ink, work, at, finite);
  if (kProbe) {
    ProbeArray(frame.probes).at[at] = GpuProbe(ink.voxel, crossed, ink.voxel.x < 0 ? 0.0 : ink.t - ray.t_eye);
  }
  if (kCount) {
    addToCounter(queries, work.queries);
    addToCounter(block_visits, work.block_visits);
    addToCounter(subblock_visits, work.subblock_visits);
    addToCounter(voxel_steps, work.voxel_steps);
  }
  if (work.loop_bound_hits != 0u) addToCounter(loop_bound_hits, work.loop_bound_hits);
  if (!finite) addToCounter(non_finite, 1u);
}
