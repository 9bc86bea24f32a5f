// SPDX-License-Identifier: Apache-2.0
// The octree finder's node array (Lukic 2017): 8 bytes a node, the root first, the eight children of a node in one run.
#pragma once

#include <span>
#include <vector>

#include "shaders/kernel_interface.h"
#include "volume/volume.h"

namespace blockwalk {

struct Octree {
  int depth = 1;  // the root's side is 2^depth leaves; at least 1
  std::vector<gpu::OctreeNode> nodes;
};

// A cell that holds something.
struct OctreeLeaf {
  glm::ivec3 position{0};  // in leaves, below 2^kMaxOctreeDepth
  std::uint32_t block = 0;
  std::uint8_t range_mask = 0;
};

// What is no leaf has nodes only as the empty siblings of what is. No two leaves may have one position. Throws
// ViewError where there are more nodes than `most_nodes`, or than an index can count.
constexpr std::size_t kMaxOctreeNodes = gpu::kNone - 8;
Octree buildOctree(std::vector<OctreeLeaf> leaves, std::size_t most_nodes = kMaxOctreeNodes);

// The leaves of a level: its blocks; or its stored subblocks.
std::vector<OctreeLeaf> blockLeaves(const Level& level);
std::vector<OctreeLeaf> subblockLeaves(const Level& level, std::span<const Subblock> ranges, int block_side);

}  // namespace blockwalk
