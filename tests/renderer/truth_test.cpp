// SPDX-License-Identifier: Apache-2.0
// The renderer against the float64 reference.
#include "tests/renderer/compare.h"
#include "tests/renderer/scenes.h"
#include "tests/renderer/views.h"
#include "volume/voxel.h"

namespace blockwalk::test {
namespace {

constexpr std::size_t kPixelsPerOtherHit = 10000;

// How many voxels of the level a ray crosses in one world unit, at most.
double voxelsPerWorld(const VolumeInfo& info) { return 1 / unitDistance(info); }

class TruthTest : public SceneTest {
 protected:
  // The default choice, and the one that takes no short cut.
  std::vector<Combination> choices() {
    const Finder plain = renderer().device().ray_query ? Finder::query : Finder::grid;
    return {Combination{}, {.finder = plain, .walk = false, .cull = false}};
  }
  std::vector<View> views() { return randomViews(scene().info, dense(), 12); }
};

TEST_P(TruthTest, BlendIsWithinTwoSteps) {
  ImageError total;
  for (const View& view : views()) {
    const reference::Image expected = reference::renderImage(dense(), view);
    for (const Combination& choice : choices()) {
      const ImageError error = compareToReference(draw(scene(), with(view, choice)), expected, view.background);
      EXPECT_LE(error.largest, kLargestError)
          << toString(choice) << ": " << error.worst << "\n  view " << toString(view);
      EXPECT_GE(error.psnr(), kLeastPsnr) << toString(choice) << "\n  view " << toString(view);
      EXPECT_LE(error.skipped * 20, expected.pixels.size()) << "too many rays in planes of faces to say anything";
      total.add(error);
    }
  }
  EXPECT_GT(total.drawn * 10, total.channels / 4) << "too little to see";
  std::printf("largest error %d, PSNR %.1f dB\n", total.largest, total.psnr());
}

TEST_P(TruthTest, FirstHitIsTheFirstVoxel) {
  ProbeError total;
  ImageError colors;
  for (View view : views()) {
    view.mode = Mode::first_hit;
    const reference::Image expected = reference::renderImage(dense(), view);
    for (const Combination& choice : choices()) {
      const Frame frame = draw(scene(), with(view, choice));
      const ProbeError error = compareHits(frame, expected, voxelsPerWorld(scene().info));
      EXPECT_EQ(error.unexcused, 0u) << toString(choice) << ": " << error.worst << "\n  view " << toString(view);
      total.add(error);
      if (error.wrong == 0) colors.add(compareToReference(frame, expected, view.background));
    }
  }
  EXPECT_GT(total.met * 10, total.pixels) << "too little to hit";
  EXPECT_LE(total.wrong * kPixelsPerOtherHit, total.pixels) << total.worst;
  EXPECT_LE(colors.largest, 1) << colors.worst;
  EXPECT_GT(colors.channels, 0u);
  std::printf("%zu of %zu hits differ\n", total.wrong, total.pixels);
}

TEST_P(TruthTest, BlocksAreCounted) {
  ProbeError total;
  for (View view : views()) {
    view.mode = Mode::blocks;
    const reference::Image expected = reference::renderImage(dense(), view);
    const Frame first = draw(scene(), with(view, combinations().front()));
    for (const Combination& choice : everyFinder()) {
      const Frame frame = draw(scene(), with(view, choice));
      EXPECT_LE(compareImages(frame, first).largest, 1) << toString(choice) << "\n  view " << toString(view);
      const ProbeError error = compareBlocks(frame, expected);
      EXPECT_EQ(error.unexcused, 0u) << toString(choice) << ": " << error.worst << "\n  view " << toString(view);
      total.add(error);
    }
  }
  EXPECT_GT(total.met * 10, total.pixels) << "too few blocks crossed";
  std::printf("%zu of %zu counts differ\n", total.wrong, total.pixels);
}

TEST_P(TruthTest, CoarserLevelsAreDrawnAsStored) {
  const std::vector<View> all = views();
  for (int level = 1; level < static_cast<int>(scene().info.levels.size()); ++level) {
    const reference::DenseVolume coarse = scene().dense(level);
    for (std::size_t i : {1u, 4u, 7u, 13u}) {
      View view = all[i];
      view.level = level;
      const Frame blend = draw(scene(), view);
      EXPECT_EQ(blend.stats.level, level);
      const ImageError error = compareToReference(blend, reference::renderImage(coarse, view), view.background);
      EXPECT_LE(error.largest, kLargestError) << error.worst << "\n  view " << toString(view);
      view.mode = Mode::first_hit;
      const ProbeError hits =
          compareHits(draw(scene(), view), reference::renderImage(coarse, view), voxelsPerWorld(scene().info));
      EXPECT_EQ(hits.unexcused, 0u) << hits.worst << "\n  view " << toString(view);
      view.mode = Mode::blocks;
      const ProbeError blocks = compareBlocks(draw(scene(), view), reference::renderImage(coarse, view));
      EXPECT_EQ(blocks.unexcused, 0u) << blocks.worst << "\n  view " << toString(view);
    }
  }
}

// What the reference looks at is itself true: the file's voxels are the source's, and its block records the voxels'.
TEST_P(TruthTest, TheFileHoldsTheSource) {
  const std::unique_ptr<Source> source = GetParam().open();
  const reference::DenseVolume expected =
      reference::volumeFromSource(*source, scene().info.channels[0].empty_threshold, scene().info.blockVoxels());
  for (int level = 0; level < static_cast<int>(scene().info.levels.size()); ++level) {
    const reference::DenseVolume stored = scene().dense(level);
    reference::DenseVolume derived = stored;
    reference::deriveBlocks(derived, stored.block_voxels);
    std::size_t wrong_blocks = 0, wrong_voxels = 0, visible = 0;
    for (std::size_t i = 0; i < stored.blocks.size(); ++i)
      wrong_blocks += stored.blocks[i] == derived.blocks[i] ? 0 : 1;
    EXPECT_EQ(wrong_blocks, 0u) << "level " << level;
    for (std::size_t i = 0; level == 0 && i < stored.density.size(); ++i) {
      if (isEmptyDensity(expected.density[i], expected.empty_threshold)) {
        wrong_voxels += isEmptyDensity(stored.density[i], stored.empty_threshold) ? 0 : 1;
        continue;
      }
      ++visible;
      const bool same_color = stored.color.empty() || stored.color[i] == expected.color[i];
      wrong_voxels += stored.density[i] == expected.density[i] && same_color ? 0 : 1;
    }
    EXPECT_EQ(wrong_voxels, 0u);
    if (level == 0) {
      EXPECT_EQ(visible, scene().info.channels[0].nonempty_voxels);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(On, TruthTest, ::testing::ValuesIn(allScenes()), sceneName);

}  // namespace
}  // namespace blockwalk::test
