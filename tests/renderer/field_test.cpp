// SPDX-License-Identifier: Apache-2.0
// The trilinear field and the modes on it (docs/integration.md): against the float64 reference, sample for sample, and
// every finder, walk and cull against each other.
#include "tests/renderer/compare.h"
#include "tests/renderer/scenes.h"
#include "tests/renderer/views.h"

namespace blockwalk::test {
namespace {

constexpr int kLargestError = 2;  // 8-bit steps
constexpr double kLeastPsnr = 55;

struct Look {
  const char* name = "";
  Mode mode = Mode::blend;
  Filter filter = Filter::linear;
  bool lit = false;
  Classification classification = Classification::post;
  double step = 0.5;
};

constexpr Look kLooks[] = {
    {.name = "blend"},
    {.name = "coarse", .step = 1.7},
    {.name = "lit", .lit = true},
    {.name = "nearest lit", .filter = Filter::nearest, .lit = true},
    {.name = "first-hit lit", .mode = Mode::first_hit, .lit = true},
    {.name = "nearest iso lit", .mode = Mode::iso, .filter = Filter::nearest, .lit = true},
    {.name = "iso", .mode = Mode::iso},
    {.name = "mip", .mode = Mode::mip},
    {.name = "nearest mip", .mode = Mode::mip, .filter = Filter::nearest},
    {.name = "mean", .mode = Mode::mean},
    {.name = "nearest mean", .mode = Mode::mean, .filter = Filter::nearest},
};

View lookAt(View view, const Look& look) {
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
  std::vector<View> views(const reference::DenseVolume& dense, std::size_t look) {
    const std::vector<View> all = randomViews(scene().info, dense, 21);
    std::vector<View> some;
    for (std::size_t i = look % 4; i < all.size(); i += 4) some.push_back(lookAt(all[i], kLooks[look]));
    return some;
  }
};

TEST_P(FieldTest, IsDrawnAsTheReferenceDraws) {
  const reference::DenseVolume dense = scene().dense(0);
  for (std::size_t look = 0; look < std::size(kLooks); ++look) {
    ImageError total;
    for (const View& view : views(dense, look)) {
      const reference::Image expected = reference::renderImage(dense, view);
      const ImageError error = compareToReference(draw(scene(), view), expected, view.background);
      EXPECT_LE(error.largest, kLargestError)
          << kLooks[look].name << ": " << error.worst << "\n  view " << toString(view);
      total.add(error);
    }
    EXPECT_GE(total.psnr(), kLeastPsnr) << kLooks[look].name;
    EXPECT_GT(total.drawn, 0u) << kLooks[look].name;
    std::printf("%s: largest error %d, PSNR %.1f dB\n", kLooks[look].name, total.largest, total.psnr());
  }
}

TEST_P(FieldTest, IsTheSameForEveryFinderWalkAndCull) {
  const reference::DenseVolume dense = scene().dense(0);
  const std::vector<Combination> combinations = RendererTest::combinations();
  for (std::size_t look = 0; look < std::size(kLooks); ++look) {
    for (const View& view : views(dense, look)) {
      const Frame first = draw(scene(), with(view, combinations.front()));
      for (std::size_t i = 1; i < combinations.size(); ++i) {
        const ImageError error = compareImages(draw(scene(), with(view, combinations[i])), first);
        EXPECT_LE(error.largest, 1) << kLooks[look].name << ": " << toString(combinations[i]) << " against "
                                    << toString(combinations.front()) << ": " << error.worst << "\n  view "
                                    << toString(view);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(On, FieldTest, ::testing::ValuesIn(allScenes()), sceneName);

}  // namespace
}  // namespace blockwalk::test
