// SPDX-License-Identifier: Apache-2.0
// One subblock at hand: where its voxels are and which of its quarters may show something.

bool isInRange(int c, float density) {
  return density >= scene.channels[c].density_lo && density <= scene.channels[c].density_hi;
}

// One subblock as each drawn channel has it.
struct SubblockVoxels {
  uint64_t at[kMaxDrawnChannels];  // device addresses
  uint channels;                   // bit c: channel c may show something here
  uvec2 quarters;                     // bit x + 4 y + 16 z: some channel may in this quarter
};

// Whether channel c need be looked at. Of one channel the subblock is visited because of it.
bool mayShow(SubblockVoxels voxels, int c) { return kChannels == 1 || !kCull || (voxels.channels >> c & 1u) != 0u; }

bool mayShowSomething(SubblockVoxels voxels) { return !kCull || (voxels.quarters.x | voxels.quarters.y) != 0u; }

bool quarterMayShow(SubblockVoxels voxels, float index) {
  uint quarter = wholeNumber(index);
  return ((quarter < 32u ? voxels.quarters.x : voxels.quarters.y) >> (quarter & 31u) & 1u) != 0u;
}

SubblockVoxels firstSubblock(uint block) {
  SubblockVoxels voxels;
  forEachChannel(c) voxels.at[c] = channelBlockAt(c, block).voxels;
  voxels.channels = 0u;
  voxels.quarters = uvec2(0u);
  return voxels;
}

// The subblock of rank `rank` in the block of `first`.
SubblockVoxels subblockOfRank(SubblockVoxels first, uint rank) {
  SubblockVoxels voxels = first;
  forEachChannel(c) voxels.at[c] += uint64_t(rank) * kSubblockBytes;
  return voxels;
}

// What of it may show something. `subblock` is its number in the level.
void findQuarters(uint subblock, inout SubblockVoxels voxels) {
  if (!kCull) return;
  forEachChannel(c) {
    uvec2 quarters = unpackUint2x32(U64Array(scene.channels[c].quarters).at[subblock]);
    voxels.channels |= (quarters.x | quarters.y) != 0u ? 1u << c : 0u;
    voxels.quarters |= quarters;
  }
}
