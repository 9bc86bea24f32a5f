// SPDX-License-Identifier: Apache-2.0
// Blocks whose voxels are absent: rays say that they want them, and see a coarser level in their place (docs/large.md).

// The ray of this invocation has come to such a block.
bool lacks_voxels = false;
uint blocks_met = 0u;  // by it

// Whether the sample is to be drawn of the pixel: the first time that a band is drawn of all of them, after that of those
// that lacked something.
bool isNext(uint at) {
  return push.sample_index == frame.fresh_sample || NextArray(frame.next_samples).at[at] == push.sample_index;
}

// Whether what the ray has seen counts. If not, the pixel is left as it is, to be drawn again.
bool isAccepted(uint at) {
  bool counts = !lacks_voxels || frame.accepts != 0u;
  NextArray(frame.next_samples).at[at] = push.sample_index + (counts ? 1u : 0u);
  return counts;
}

// How soon what a ray comes to is to be asked for: 0 first. By shells (Reese 2019, 4): the blocks that it has come to
// before; by what is left of its light there, each half of it a rank.
uint rankOfRequest(float transmittance) {
  uint rank = frame.requests == kRequestsShells ? blocks_met : uint(max(-log2(transmittance), 0.0));
  return min(rank, kRequestRanks - 1u);
}

// Says that a ray comes to the block. Whether some drawn channel's voxels are absent.
bool wantVoxels(uint block, float transmittance) {
  uint word = scene.pages + (block >> 5);
  if (frame.rank_words != 0u) word += frame.rank_words * rankOfRequest(transmittance);
  uint bit = 1u << (block & 31u);
  // Mostly it is set: to look is cheaper than to set it again.
  if ((BitArray(frame.wanted).at[word] & bit) == 0u) atomicOr(BitArray(frame.wanted).at[word], bit);
  bool absent = false;
  forEachChannel(c) absent = absent || channelBlockAt(c, block).voxels == uint64_t(0);
  lacks_voxels = lacks_voxels || absent;
  return absent;
}

// What integrates is given the block's own voxels or, where they are absent, the part of the coarser level's block that
// covers it: in that level's coordinates, between the same planes. So each point of a ray lies in a voxel of one level.
// Without such a block t_end becomes t_begin. Whether it does. `transmittance`: what the ray has left there.
bool standIn(float transmittance, inout Ray ray, inout uint block, inout vec3 corner, inout float t_begin, inout float t_end) {
  if (block == kNone || (kMixed && scene.pages == kNone)) return false;
  bool absent = wantVoxels(block, transmittance);
  ++blocks_met;
  if (!absent) return false;
  block = UintArray(scene.ancestors).at[block];
  if (block == kNone) {
    t_end = t_begin;
    return false;
  }
  uint shift = Frame(push.frame).data.coarse[frame.stand_in].shift;
  ivec3 anchor = Frame(push.frame).data.coarse[frame.stand_in].anchor;
  ray = coarserRay(ray, scene.anchor, anchor, shift - scene.voxel_shift);
  scene.sample_bound = frame.sample_bound << (shift - scene.voxel_shift);
  forEachChannel(c) scene.channels[c] = Frame(push.frame).data.coarse[frame.stand_in].channels[c];
  scene.anchor = vec3(anchor);
  scene.pages = kNone;
  setScale(shift);
  corner = blockCorner(block);
  vec2 interval = cubeInterval(ray, corner, float(kBlockVoxels));
  t_begin = max(t_begin, interval.x);
  t_end = min(t_end, interval.y);
  return true;
}

// Back to the level that rays walk through.
void standBack() { loadLevel(scene.level); }
