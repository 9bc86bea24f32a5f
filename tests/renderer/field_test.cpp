// SPDX-License-Identifier: Apache-2.0
// The trilinear field and the modes on it (docs/integration.md): against the float64 reference, sample for sample, and
// every finder, walk and cull against each other.
#include <algorithm>
#include <string_view>

#include "tests/renderer/compare.h"
#include "tests/renderer/scenes.h"
#include "tests/renderer/views.h"

namespace blockwalk::test {
namespace {

struct FieldLook {
  std::string_view name{};
  Mode mode = Mode::blend;
  Filter filter = Filter::linear;
  bool lit = false;
  Classification classification = Classification::post;
  double step = 0.5;
};

constexpr FieldLook kFieldLooks[] = {
    {.name = "blend"},
    {.name = "coarse", .step = 1.7},
    {.name = "lit", .lit = true},
    {.name = "pre-integrated", .classification = Classification::pre_integrated, .step = 1},
    {.name = "nearest lit", .filter = Filter::nearest, .lit = true},
    {.name = "first-hit lit", .mode = Mode::first_hit, .lit = true},
    {.name = "nearest iso lit", .mode = Mode::iso, .filter = Filter::nearest, .lit = true},
    {.name = "iso", .mode = Mode::iso},
    {.name = "mip", .mode = Mode::mip},
    {.name = "nearest mip", .mode = Mode::mip, .filter = Filter::nearest},
    {.name = "minip", .mode = Mode::minip},
    {.name = "nearest minip", .mode = Mode::minip, .filter = Filter::nearest},
    {.name = "attenuated-mip", .mode = Mode::attenuated_mip},
    {.name = "nearest attenuated-mip", .mode = Mode::attenuated_mip, .filter = Filter::nearest},
    {.name = "mean", .mode = Mode::mean},
    {.name = "nearest mean", .mode = Mode::mean, .filter = Filter::nearest},
};

View fieldView(View view, const FieldLook& look) {
  view.mode = look.mode;
  view.filter = look.filter;
  view.lit = look.lit;
  view.classification = look.classification;
  view.step = look.step;
  return view;
}

class FieldTest : public SceneTest {
 protected:
  // Every fourth of the usual views, a different set for every look.
  std::vector<View> viewsOf(std::size_t look) {
    const std::vector<View> all = randomViews(scene().info, dense(), 21);
    std::vector<View> some;
    if (kFieldLooks[look].classification != Classification::post && scene().info.type == VoxelType::rgba8) return some;
    for (std::size_t i = look % 4; i < all.size(); i += 4) some.push_back(fieldView(all[i], kFieldLooks[look]));
    return some;
  }
};

TEST_P(FieldTest, IsDrawnAsTheReferenceDraws) {
  for (std::size_t look = 0; look < std::size(kFieldLooks); ++look) {
    ImageError total;
    const std::vector<View> views = viewsOf(look);
    if (views.empty()) continue;
    for (const View& view : views) {
      const reference::Image expected = reference::renderImage(dense(), view);
      const bool linear = kFieldLooks[look].filter == Filter::linear;
      const double near_jump = linear ? kNearJump * dense().contrast : 0;
      const ImageError error = compareToReference(draw(scene(), view), expected, view.background, near_jump);
      EXPECT_LE(error.largest, kLargestError)
          << kFieldLooks[look].name << ": " << error.worst << "\n  view " << toString(view);
      total.add(error);
    }
    EXPECT_GE(total.psnr(), kLeastPsnr) << kFieldLooks[look].name;
    EXPECT_GT(total.drawn, 0u) << kFieldLooks[look].name;
    EXPECT_LE(total.skipped * 8, total.channels)
        << kFieldLooks[look].name << ": too many samples at jumps to say anything";
    std::printf("%s: largest error %d, PSNR %.1f dB, %zu skipped\n", kFieldLooks[look].name.data(), total.largest,
                total.psnr(), total.skipped);
  }
}

// combinations_test.cpp compares every pair for the nearest filter. What the field adds is the apron and its ranges,
// the same for every look: three of them meet a sample, a crossing and an interval between two densities. A minimum has
// a field of its own, and what is attenuated stops before its ray ends.
TEST_P(FieldTest, IsTheSameForEveryFinderWalkAndCull) {
  for (const std::string_view name : {"blend", "first-hit lit", "pre-integrated", "minip", "attenuated-mip"}) {
    const auto look =
        static_cast<std::size_t>(std::ranges::find(kFieldLooks, name, &FieldLook::name) - std::begin(kFieldLooks));
    const std::vector<View> all_views = viewsOf(look);
    for (std::size_t v = 0; v < all_views.size(); ++v) {
      const View& view = all_views[v];
      std::vector<Combination> combinations = everyFinder();
      // A kernel takes half a second or more to compile: of the other views both or neither.
      if (v > 0) std::erase_if(combinations, [](const Combination& c) { return c.walk != c.cull; });
      const Frame first = draw(scene(), with(view, combinations.front()));
      for (std::size_t i = 1; i < combinations.size(); ++i) {
        const ImageError error = compareImages(draw(scene(), with(view, combinations[i])), first);
        EXPECT_LE(error.largest, 1) << name << ": " << toString(combinations[i]) << " against "
                                    << toString(combinations.front()) << ": " << error.worst << "\n  view "
                                    << toString(view);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(On, FieldTest, ::testing::ValuesIn(allScenes()), sceneName);

}  // namespace
}  // namespace blockwalk::test
