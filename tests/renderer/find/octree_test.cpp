// SPDX-License-Identifier: Apache-2.0
// The node array of the octree finder: every leaf is reached by its place, and nothing else is.
#include "renderer/find/octree.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"

namespace blockwalk {
namespace {

using Place = std::array<int, 3>;

// Every leaf that is reached from the root, by place. Counts the nodes seen on the way.
void collect(const Octree& octree, std::uint32_t node, glm::ivec3 cell, int height,
             std::map<Place, gpu::OctreeNode>& found, std::set<std::uint32_t>& seen) {
  EXPECT_TRUE(seen.insert(node).second) << "node " << node << " is reached twice";
  const gpu::OctreeNode& at = octree.nodes.at(node);
  if (at.mask == 0) return;
  EXPECT_NE(at.mask & gpu::kOctreeStored, 0u);
  if (height == 0) {
    found[{cell.x, cell.y, cell.z}] = at;
    return;
  }
  std::uint32_t together = 0;
  for (std::uint32_t octant = 0; octant < 8; ++octant) {
    const glm::ivec3 child = 2 * cell + glm::ivec3(octant & 1, octant >> 1 & 1, octant >> 2);
    collect(octree, at.first + octant, child, height - 1, found, seen);
    together |= octree.nodes.at(at.first + octant).mask;
  }
  EXPECT_EQ(at.mask, together) << "a node's mask is what lies below it";
}

void expectLeaves(const std::vector<OctreeLeaf>& leaves) {
  const Octree octree = buildOctree(leaves);
  std::map<Place, gpu::OctreeNode> found;
  std::set<std::uint32_t> seen;
  collect(octree, 0, glm::ivec3(0), octree.depth, found, seen);
  EXPECT_EQ(found.size(), leaves.size());
  for (const OctreeLeaf& leaf : leaves) {
    const auto at = found.find({leaf.position.x, leaf.position.y, leaf.position.z});
    ASSERT_NE(at, found.end());
    EXPECT_EQ(at->second.first, leaf.block);
    EXPECT_EQ(at->second.mask, gpu::kOctreeStored | leaf.range_mask);
  }
  EXPECT_EQ(seen.size(), leaves.empty() ? 1 : octree.nodes.size()) << "nodes that nothing leads to";
}

TEST(Octree, ReachesEveryLeafAndNoOther) {
  std::mt19937 random(1);
  for (int side : {1, 2, 3, 7, 40, 1000, 16384}) {
    std::map<Place, OctreeLeaf> leaves;
    std::uniform_int_distribution<int> place(0, side - 1);
    for (int i = 0; i < 300; ++i) {
      const glm::ivec3 position(place(random), place(random), place(random));
      leaves[{position.x, position.y, position.z}] = {.position = position,
                                                      .block = static_cast<std::uint32_t>(i),
                                                      .range_mask = static_cast<std::uint8_t>(1 + i % 255)};
    }
    std::vector<OctreeLeaf> list;
    for (const auto& [at, leaf] : leaves) list.push_back(leaf);
    std::ranges::shuffle(list, random);
    expectLeaves(list);
  }
}

TEST(Octree, IsAsDeepAsItsFarthestLeaf) {
  EXPECT_EQ(buildOctree({}).depth, 1);
  EXPECT_EQ(buildOctree({{.position = {0, 0, 0}, .block = 0, .range_mask = 1}}).depth, 1);
  EXPECT_EQ(buildOctree({{.position = {1, 0, 1}, .block = 0, .range_mask = 1}}).depth, 1);
  EXPECT_EQ(buildOctree({{.position = {0, 2, 0}, .block = 0, .range_mask = 1}}).depth, 2);
  EXPECT_EQ(buildOctree({{.position = {0, 0, 16383}, .block = 0, .range_mask = 1}}).depth, 14);
  expectLeaves({});
}

TEST(Octree, OfTooManyNodesIsRefused) {
  std::vector<OctreeLeaf> leaves;
  for (int i = 0; i < 8; ++i) leaves.push_back({.position = {16 * i, 0, 0}, .block = 0, .range_mask = 1});
  const std::size_t nodes = buildOctree(leaves).nodes.size();
  EXPECT_EQ(buildOctree(leaves, nodes).nodes.size(), nodes);
  try {
    buildOctree(leaves, nodes - 1);
    ADD_FAILURE() << "more nodes than may be";
  } catch (const ViewError& error) {
    EXPECT_EQ(error.field, "finder");
  }
}

// A whole file's subblocks, by the voxels of the dense volume.
class OctreeOfLevel : public test::RendererTest {};

TEST_F(OctreeOfLevel, HoldsTheSubblocksWithVoxels) {
  BuildOptions options;
  options.subblock_side = 4;
  options.block_side = 3;
  const test::Scene scene =
      makeScene(*test::makeSynthetic({.type = VoxelType::u8, .dims = {50, 41, 37}, .seed = 7}), options);
  const VolumeFile file(scene.path);
  const Level level = file.readLevel(0, 0);
  const std::vector<OctreeLeaf> leaves = subblockLeaves(level, level.subblocks, 3);
  EXPECT_EQ(leaves.size(), level.subblocks.size());
  expectLeaves(leaves);
  const reference::DenseVolume dense = scene.dense(0);
  std::set<Place> occupied;
  std::size_t voxel = 0;
  for (int z = 0; z < 37; ++z) {
    for (int y = 0; y < 41; ++y) {
      for (int x = 0; x < 50; ++x, ++voxel) {
        if (!isEmptyDensity(dense.density[voxel], dense.empty_threshold)) occupied.insert({x / 4, y / 4, z / 4});
      }
    }
  }
  std::set<Place> stored;
  for (const OctreeLeaf& leaf : leaves) stored.insert({leaf.position.x, leaf.position.y, leaf.position.z});
  EXPECT_EQ(stored, occupied);
  EXPECT_GT(occupied.size(), 100u);
  expectLeaves(blockLeaves(level));
}

}  // namespace
}  // namespace blockwalk
