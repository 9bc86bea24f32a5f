// SPDX-License-Identifier: Apache-2.0
// What blocks must not change, and what walking and culling must save.
#include <gtest/gtest.h>

#include <span>

#include "tests/renderer/compare.h"
#include "tests/renderer/scenes.h"
#include "tests/renderer/synthetic.h"
#include "tests/renderer/views.h"
#include "volume/demo/demo.h"

namespace blockwalk::test {
namespace {

BuildOptions sides(int subblock, int block) {
  BuildOptions options;
  options.subblock_side = subblock;
  options.block_side = block;
  return options;
}

class BlocksTest : public RendererTest {
 protected:
  static void expectSameForBlocks(Source& source, std::span<const glm::ivec2> all_sides) {
    Scene first = makeScene(source);
    const std::vector<View> all = randomViews(first.info, first.dense(0), 21);
    for (const glm::ivec2& side : all_sides) {
      Scene other = makeScene(source, sides(side.x, side.y));
      ASSERT_EQ(other.info.blockVoxels(), side.x * side.y);
      for (std::size_t i : {0u, 3u, 6u, 10u, 12u, 19u}) {
        for (Mode mode : {Mode::blend, Mode::first_hit}) {
          View view = all[i];
          view.mode = mode;
          const ImageError error = compareImages(draw(other, view), draw(first, view));
          EXPECT_LE(error.largest, 1) << "subblocks " << side.x << ", blocks " << side.y << ": " << error.worst
                                      << "\n  view " << toString(view);
        }
      }
    }
  }
};

constexpr glm::ivec2 kManySides[] = {{4, 1}, {8, 2}, {16, 3}, {4, 4}, {8, 5}, {16, 6}};
constexpr glm::ivec2 kFewSides[] = {{4, 5}, {16, 2}};

TEST_F(BlocksTest, ColourImageDoesNotDependOnThem) {
  expectSameForBlocks(*makeSynthetic({.type = VoxelType::rgba8, .dims = {70, 64, 57}}), kManySides);
}

TEST_F(BlocksTest, ScalarImageDoesNotDependOnThem) {
  expectSameForBlocks(
      *makeSynthetic({.type = VoxelType::u16, .dims = {40, 66, 51}, .seed = 5, .world_from_index = obliqueMap(true)}),
      kFewSides);
}

// Range open, seen from outside: what the paper's figure 9 counts.
View openView(const VolumeInfo& info) {
  View view;
  view.width = 128;
  view.height = 96;
  view.level = 0;
  view.mode = Mode::blocks;
  return spellOut(resolveView(view, info));
}

class RangeTest : public BlocksTest, public ::testing::WithParamInterface<const char*> {};

TEST_P(RangeTest, WalkingCutsQueries) {
  // Blocks of 16 voxels: at 128 voxels as many along a ray as blocks of 48 at 384.
  Scene scene = makeScene(*openDemo(GetParam(), 128), sides(4, 4));
  for (Finder finder : {Finder::grid, Finder::query}) {
    if (finder == Finder::query && !renderer().device().ray_query) continue;
    const View view = openView(scene.info);
    const RenderStats plain = draw(scene, with(view, {.finder = finder, .walk = false, .cull = true})).stats;
    const RenderStats walking = draw(scene, with(view, {.finder = finder, .walk = true, .cull = true})).stats;
    EXPECT_LE(walking.queries * 3, plain.queries) << toString(Combination{.finder = finder});
    EXPECT_EQ(walking.block_visits, plain.block_visits);
    std::printf("queries %zu, walking %zu\n", std::size_t{plain.queries}, std::size_t{walking.queries});
  }
}

TEST_P(RangeTest, CullingCutsVisits) {
  Scene scene = makeScene(*openDemo(GetParam(), 128), sides(4, 4));
  View view = openView(scene.info);
  view.mode = Mode::blend;
  const double lo = scene.info.channels[0].dataFromStored(static_cast<double>(scene.info.channels[0].density_min));
  const double hi = scene.info.channels[0].dataFromStored(static_cast<double>(scene.info.channels[0].density_max));
  view.channels[0].range = DensityRange{.lo = hi - 0.1 * (hi - lo), .hi = hi};
  for (const Combination& combination : combinations()) {
    if (combination.cull) continue;
    const RenderStats plain = draw(scene, with(view, combination)).stats;
    const RenderStats culling =
        draw(scene, with(view, {.finder = combination.finder, .walk = combination.walk, .cull = true})).stats;
    EXPECT_LT(culling.block_visits, plain.block_visits) << toString(combination);
    EXPECT_LT(culling.subblock_visits, plain.subblock_visits) << toString(combination);
    EXPECT_LT(culling.voxel_steps, plain.voxel_steps) << toString(combination);
  }
}

INSTANTIATE_TEST_SUITE_P(On, RangeTest, ::testing::Values("rock", "fossil"),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace blockwalk::test
