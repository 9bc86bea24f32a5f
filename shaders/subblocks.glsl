// SPDX-License-Identifier: Apache-2.0
// One subblock at hand: where its voxels are and which of its cells may show something.

bool isInRange(int c, float density) {
  return density >= scene.channels[c].density_lo && density <= scene.channels[c].density_hi;
}

// One subblock as each drawn channel has it.
struct SubblockVoxels {
  uint64_t at[kMaxDrawnChannels];  // device addresses
  uint channels;                   // bit c: channel c may show something here
  uvec2 cells;                     // bit x + 4 y + 16 z: some channel may in this cell of a quarter of the side
};

// Whether channel c need be looked at. Of one channel the subblock is visited because of it.
bool mayShow(SubblockVoxels voxels, int c) { return kChannels == 1 || !kCull || (voxels.channels >> c & 1u) != 0u; }

bool mayShowSomething(SubblockVoxels voxels) { return !kCull || (voxels.cells.x | voxels.cells.y) != 0u; }

bool cellMayShow(SubblockVoxels voxels, float index) {
  uint cell = wholeNumber(index);
  return ((cell < 32u ? voxels.cells.x : voxels.cells.y) >> (cell & 31u) & 1u) != 0u;
}

SubblockVoxels firstSubblock(uint block) {
  SubblockVoxels voxels;
  forEachChannel(c) voxels.at[c] = channelBlockAt(c, block).voxels;
  voxels.channels = 0u;
  voxels.cells = uvec2(0u);
  return voxels;
}

// The subblock of rank `rank` in the block of `first`.
SubblockVoxels subblockOfRank(SubblockVoxels first, uint rank) {
  SubblockVoxels voxels = first;
  forEachChannel(c) voxels.at[c] += uint64_t(rank) * kSubblockBytes;
  return voxels;
}

// What of it may show something. `subblock` is its number in the level.
void findCells(uint subblock, inout SubblockVoxels voxels) {
  if (!kCull) return;
  forEachChannel(c) {
    uvec2 cells = unpackUint2x32(U64Array(scene.channels[c].cells).at[subblock]);
    voxels.channels |= (cells.x | cells.y) != 0u ? 1u << c : 0u;
    voxels.cells |= cells;
  }
}
