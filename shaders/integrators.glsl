// SPDX-License-Identifier: Apache-2.0
// Integrators: what is accumulated between a block's entry and its exit.

void integrateSubblock(Ray ray, uint block, SubblockVoxels voxels, vec3 corner, float t_begin, float t_end, inout Ink ink,
                       inout Work work) {
  if (kFilter == kFilterNearest) {
    integrateNearest(ray, voxels, corner, t_begin, t_end, ink, work);
  } else if (kClassification == kClassificationPreIntegrated) {
    integratePreIntegrated(ray, voxels, corner, t_begin, t_end, ink, work);
  } else {
    integrateLinear(ray, block, voxels, corner, t_begin, t_end, ink, work);
  }
  settle(ink);
}

void integrateBlock(Ray ray, uint block, float t_begin, float t_end, inout Ink ink, inout Work work) {
  const vec3 count = vec3(kBlockSide);
  const float side = float(kSubblockSide);
  SubblockVoxels first = firstSubblock(block);
  uint first_subblock = blockAt(block).first_subblock;
  Dda subblocks = enterDda(ray, blockCorner(block), side, count, latticeStrides(count), t_begin);
  for (int i = 0; i <= 3 * kBlockSide; ++i) {
    uint rank = subblockRank(block, wholeNumber(subblocks.index));
    float t_exit = min(subblocks.t_exit, t_end);
    if (rank != kNoSubblock && t_exit > subblocks.t) {
      uint channels = channelsIn(first_subblock + rank);
      if (channels != 0u) {
        if (kTally) work.subblock_visits += 1u;
        integrateSubblock(ray, block, subblockOfRank(first, rank, channels), subblocks.far - side * ray.forward,
                          subblocks.t, t_exit, ink, work);
      }
    }
    if (ink.done || subblocks.t_exit >= t_end) return;
    stepDda(ray, side, latticeStrides(count), subblocks);
  }
  work.loop_bound_hits += 1u;
}
