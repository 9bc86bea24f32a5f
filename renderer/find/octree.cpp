// SPDX-License-Identifier: Apache-2.0
#include "renderer/find/octree.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "view/view.h"
#include "volume/error.h"

namespace blockwalk {
namespace {

struct CodedLeaf {
  std::uint64_t code = 0;  // Morton: three bits a level of the tree, the root's first
  OctreeLeaf leaf;
};

class Builder {
 public:
  Builder(Octree& octree, std::size_t most_nodes) : octree_(octree), most_nodes_(most_nodes) {}

  // Fills a node of side 2^height leaves that holds these leaves, ascending, at least one; returns its mask.
  std::uint32_t fill(std::size_t node, std::span<const CodedLeaf> leaves, int height) {
    std::uint32_t mask = gpu::kOctreeStored;
    if (height == 0) {
      BLOCKWALK_CHECK(leaves.size(), ==, 1u);
      octree_.nodes[node] = {.first = leaves[0].leaf.block, .mask = mask | leaves[0].leaf.range_mask};
      return octree_.nodes[node].mask;
    }
    const std::size_t children = octree_.nodes.size();
    if (children + 8 > most_nodes_) {
      throw ViewError("finder",
                      fmt::format("octree: the level needs more than {} nodes; use a coarser level or another "
                                  "finder",
                                  most_nodes_));
    }
    octree_.nodes.resize(children + 8);
    const int shift = 3 * (height - 1);
    while (!leaves.empty()) {
      const std::uint64_t octant = leaves[0].code >> shift & 7;
      const auto end =
          std::ranges::find_if(leaves, [&](const CodedLeaf& l) { return (l.code >> shift & 7) != octant; });
      const auto count = static_cast<std::size_t>(end - leaves.begin());
      mask |= fill(children + octant, leaves.first(count), height - 1);
      leaves = leaves.subspan(count);
    }
    octree_.nodes[node] = {.first = static_cast<std::uint32_t>(children), .mask = mask};
    return mask;
  }

 private:
  Octree& octree_;
  std::size_t most_nodes_;
};

}  // namespace

Octree buildOctree(std::vector<OctreeLeaf> leaves, std::size_t most_nodes) {
  Octree octree;
  octree.nodes.resize(1);
  std::vector<CodedLeaf> coded;
  coded.reserve(leaves.size());
  for (const OctreeLeaf& leaf : leaves) {
    coded.push_back({.code = mortonCode(glm::uvec3(leaf.position)), .leaf = leaf});
    while (octree.depth < gpu::kMaxOctreeDepth && coded.back().code >> (3 * octree.depth) != 0) ++octree.depth;
  }
  std::ranges::sort(coded, {}, &CodedLeaf::code);
  if (coded.empty()) {
    octree.nodes.resize(9);
    octree.nodes[0].first = 1;
  } else {
    Builder(octree, most_nodes).fill(0, coded, octree.depth);
  }
  return octree;
}

std::vector<OctreeLeaf> blockLeaves(const Level& level) {
  std::vector<OctreeLeaf> leaves;
  for (std::size_t i = 0; i < level.blocks.size(); ++i) {
    const Block& block = level.blocks[i];
    leaves.push_back(
        {.position = block.origin, .block = static_cast<std::uint32_t>(i), .range_mask = block.range_mask});
  }
  return leaves;
}

std::vector<OctreeLeaf> subblockLeaves(const Level& level, std::span<const Subblock> ranges, int block_side) {
  std::vector<OctreeLeaf> leaves;
  for (std::size_t i = 0; i < level.blocks.size(); ++i) {
    const Block& block = level.blocks[i];
    std::size_t rank = 0;
    for (int local = 0; local < block_side * block_side * block_side; ++local) {
      if ((block.occupancy[static_cast<std::size_t>(local / 64)] >> (local % 64) & 1) == 0) continue;
      const glm::ivec3 place(local % block_side, local / block_side % block_side, local / (block_side * block_side));
      leaves.push_back({.position = block.origin * block_side + place,
                        .block = static_cast<std::uint32_t>(i),
                        .range_mask = ranges[block.first_subblock + rank++].range_mask});
    }
  }
  return leaves;
}

}  // namespace blockwalk
