// SPDX-License-Identifier: Apache-2.0
// Pictures show that a specialised kernel draws what it should; here is that the rest has gone.
#include "renderer/vulkan/specialise.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "render_rayquery.spv.h"
#include "renderer/renderer.h"
#include "shaders/kernel_interface.h"

namespace blockwalk {
namespace {

// SPIR-V specification, 2.3 and 3.52.
constexpr std::size_t kHeaderWords = 5;
constexpr std::uint32_t kOpSpecConstant = 50;
constexpr std::uint32_t kOpFunction = 54;
constexpr std::uint32_t kOpRayQueryInitialize = 4473;

std::size_t count(std::span<const std::uint32_t> words, std::uint32_t opcode) {
  std::size_t found = 0;
  for (std::size_t at = kHeaderWords; at < words.size(); at += words[at] >> 16)
    found += (words[at] & 0xffffu) == opcode;
  return found;
}

KernelKey keyOf(std::uint32_t finder, std::uint32_t mode) {
  KernelKey key;
  key.finder = finder;
  key.mode = mode;
  key.subblock_side = 8;
  key.block_side = 6;
  return key;
}

TEST(Specialise, LeavesNoChoiceAndOnlyWhatIsUsed) {
  const std::span<const std::uint32_t> whole = render_rayquery_spirv;
  ASSERT_GT(count(whole, kOpSpecConstant), 0u);
  ASSERT_GT(count(whole, kOpRayQueryInitialize), 0u);
  const auto grid = specialise(whole, keyOf(gpu::kFinderGrid, gpu::kModeBlocks));
  const auto query = specialise(whole, keyOf(gpu::kFinderQuery, gpu::kModeBlocks));
  for (const auto& words : {grid, query}) {
    EXPECT_EQ(count(words, kOpSpecConstant), 0u);
    EXPECT_LT(count(words, kOpFunction) * 2, count(whole, kOpFunction));
    EXPECT_LT(words.size() * 2, whole.size());
  }
  EXPECT_EQ(count(grid, kOpRayQueryInitialize), 0u);
  EXPECT_GT(count(query, kOpRayQueryInitialize), 0u);
}

TEST(Specialise, RefusesWhatIsNoModule) {
  const std::vector<std::uint32_t> words{1, 2, 3, 4, 5, 6, 7};
  EXPECT_THROW(specialise(words, KernelKey{}), DeviceError);
}

}  // namespace
}  // namespace blockwalk
