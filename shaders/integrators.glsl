// SPDX-License-Identifier: Apache-2.0
// Integrators: what is accumulated between a block's entry and its exit.

void integrateSpan(Ray ray, uint block, SubblockVoxels voxels, vec3 corner, float t_begin, float t_end, inout Ink ink,
                   inout Work work) {
  if (kFilter == kFilterNearest) {
    integrateNearest(ray, voxels, corner, t_begin, t_end, ink, work);
  } else if (kClassification == kClassificationPreIntegrated) {
    integratePreIntegrated(ray, voxels, corner, t_begin, t_end, ink, work);
  } else {
    integrateLinear(ray, block, voxels, corner, t_begin, t_end, ink, work);
  }
}

// On to the first quarter that may show something, or that may not, or to the last before t_end.
void stepQuarters(Ray ray, SubblockVoxels voxels, bool shows, float t_end, inout Dda quarters) {
  for (int i = 0; i < 12; ++i) {
    if (quarters.t_exit >= t_end || quarterMayShow(voxels, quarters.index) == shows) return;
    stepDda(ray, 0.25 * float(kSubblockSide), latticeStrides(vec3(4.0)), quarters);
  }
}

// Over the spans of the ray in quarters that may show something. They are found before they are integrated, quarter
// by quarter in short loops without loads: a subgroup then spends its time on rays that have something to do.
void integrateSubblock(Ray ray, uint block, SubblockVoxels voxels, vec3 corner, float t_begin, float t_end, inout Ink ink,
                       inout Work work) {
  // Pre-integrated pieces would be others if they were cut at quarters.
  BLOCKWALK_DERIVED bool by_quarters = kCull && kClassification != kClassificationPreIntegrated;
  Dda quarters;
  if (by_quarters) {
    quarters = enterDda(ray, corner, 0.25 * float(kSubblockSide), vec3(4.0), latticeStrides(vec3(4.0)), t_begin);
  }
  float t_from = t_begin;
  float t_to = t_end;
  for (int i = 0; i < 12; ++i) {
    if (by_quarters) {
      stepQuarters(ray, voxels, true, t_end, quarters);
      if (!quarterMayShow(voxels, quarters.index)) break;
      t_from = quarters.t;
      stepQuarters(ray, voxels, false, t_end, quarters);
      t_to = quarterMayShow(voxels, quarters.index) ? t_end : quarters.t;
    }
    integrateSpan(ray, block, voxels, corner, t_from, t_to, ink, work);
    if (ink.done || t_to >= t_end) break;
  }
  settle(ink);
}

// `corner` is the block's lowest; `block` is kNone where a march comes through a place without one. This is the only place
// that integrates: a second one doubles the general kernel, and what drivers take to compile it grows faster than that.
void integrateBlock(Ray ray, uint block, vec3 corner, float t_begin, float t_end, inout Ink ink, inout Work work) {
  const vec3 count = vec3(kBlockSide);
  const float side = float(kSubblockSide);
  bool stored = !kMarches || block != kNone;
  SubblockVoxels first;
  uint first_subblock = 0u;
  if (stored) {
    first = firstSubblock(block);
    first_subblock = blockAt(block).first_subblock;
  }
  Dda subblocks = enterDda(ray, corner, side, count, latticeStrides(count), t_begin);
  for (int i = 0; i <= 3 * kBlockSide; ++i) {
    uint rank = stored ? subblockRank(block, wholeNumber(subblocks.index)) : kNoSubblock;
    float t_exit = min(subblocks.t_exit, t_end);
    if ((kMarches || rank != kNoSubblock) && t_exit > subblocks.t) {
      SubblockVoxels voxels;
      if (kMarches && rank == kNoSubblock) {
        voxels = emptySubblock();
      } else {
        voxels = subblockOfRank(first, rank);
      }
      findQuarters(first_subblock + rank, voxels);
      if (mayShowSomething(voxels)) {
        if (kTally) work.subblock_visits += 1u;
        integrateSubblock(ray, block, voxels, subblocks.far - side * ray.forward, subblocks.t, t_exit, ink, work);
      }
    }
    if (ink.done || subblocks.t_exit >= t_end) return;
    stepDda(ray, side, latticeStrides(count), subblocks);
  }
  work.loop_bound_hits += 1u;
}
