// SPDX-License-Identifier: Apache-2.0
// Every finder, with and without walking and culling, gives the same image: they only skip what contributes nothing.
// truth_test.cpp says the same of mode `blocks`.
#include "tests/renderer/compare.h"
#include "tests/renderer/scenes.h"
#include "tests/renderer/views.h"

namespace blockwalk::test {
namespace {

using CombinationsTest = SceneTest;

// An open range, and a narrow one, clipped, both from inside: these kernels differ.
constexpr std::size_t kOpenView = 3;
constexpr std::size_t kNarrowView = 14;

TEST_P(CombinationsTest, GiveTheSameImage) {
  const std::vector<View> views = randomViews(scene().info, dense(), 11);
  for (std::size_t v = 0; v < views.size(); ++v) {
    for (Mode mode : {Mode::blend, Mode::first_hit}) {
      View view = views[v];
      view.mode = mode;
      // A kernel takes a second or two to compile: walk and cull of every finder are tried where ranges are narrow.
      std::vector<Combination> combinations = RendererTest::combinations();
      if (v == kOpenView || v == kNarrowView) combinations = everyFinder();
      if (v == kNarrowView && mode == Mode::blend) combinations = allCombinations();
      const Frame first = draw(scene(), with(view, combinations.front()));
      for (std::size_t i = 1; i < combinations.size(); ++i) {
        const Frame other = draw(scene(), with(view, combinations[i]));
        const ImageError error = compareImages(other, first);
        EXPECT_LE(error.largest, 1) << toString(combinations[i]) << " against " << toString(combinations.front())
                                    << ": " << error.worst << "\n  view " << toString(view);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(On, CombinationsTest, ::testing::ValuesIn(allScenes()), sceneName);

}  // namespace
}  // namespace blockwalk::test
