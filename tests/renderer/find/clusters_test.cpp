// SPDX-License-Identifier: Apache-2.0
// Boxes of active macrocells are disjoint and cover exactly them.
#include "renderer/find/clusters.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "shaders/kernel_interface.h"

namespace blockwalk {
namespace {

std::size_t indexOf(glm::ivec3 macrocell, glm::ivec3 dims) {
  return static_cast<std::size_t>(macrocell.x + dims.x * (macrocell.y + dims.y * macrocell.z));
}

std::size_t expectExactCover(const std::vector<std::uint8_t>& states, glm::ivec3 dims) {
  std::vector<int> covered(states.size(), 0);
  const std::vector<MacrocellBox> boxes = mergeMacrocells(states, dims);
  for (const MacrocellBox& box : boxes) {
    for (int z = box.lo.z; z < box.hi.z; ++z) {
      for (int y = box.lo.y; y < box.hi.y; ++y) {
        for (int x = box.lo.x; x < box.hi.x; ++x) ++covered.at(indexOf({x, y, z}, dims));
      }
    }
  }
  for (std::size_t i = 0; i < states.size(); ++i) {
    EXPECT_EQ(covered[i], states[i] == gpu::kMacrocellActive ? 1 : 0) << "macrocell " << i;
  }
  return boxes.size();
}

TEST(Clusters, AreDisjointAndCoverTheActiveMacrocells) {
  std::mt19937 random(3);
  for (const glm::ivec3& dims : {glm::ivec3(1), glm::ivec3(7, 5, 9), glm::ivec3(1, 30, 2), glm::ivec3(16)}) {
    for (int percent : {0, 3, 50, 97, 100}) {
      std::vector<std::uint8_t> states(static_cast<std::size_t>(dims.x * dims.y * dims.z));
      for (std::uint8_t& state : states) {
        const bool active = static_cast<int>(random() % 100) < percent;
        state = static_cast<std::uint8_t>(active ? gpu::kMacrocellActive : random() % gpu::kMacrocellActive);
      }
      const std::size_t boxes = expectExactCover(states, dims);
      if (percent == 0) {
        EXPECT_EQ(boxes, 0u);
      }
      if (percent == 100) {
        EXPECT_EQ(boxes, 1u);
      }
    }
  }
}

// What is a box comes back as one.
TEST(Clusters, GrowAlongEveryAxis) {
  const glm::ivec3 dims(9, 8, 7);
  std::vector<std::uint8_t> states(9 * 8 * 7, gpu::kMacrocellCalm);
  const MacrocellBox box{.lo = {2, 3, 1}, .hi = {8, 5, 7}};
  for (int z = box.lo.z; z < box.hi.z; ++z) {
    for (int y = box.lo.y; y < box.hi.y; ++y) {
      for (int x = box.lo.x; x < box.hi.x; ++x) states[indexOf({x, y, z}, dims)] = gpu::kMacrocellActive;
    }
  }
  EXPECT_EQ(mergeMacrocells(states, dims), std::vector<MacrocellBox>{box});
}

}  // namespace
}  // namespace blockwalk
