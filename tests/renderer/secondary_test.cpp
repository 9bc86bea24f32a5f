// SPDX-License-Identifier: Apache-2.0
// Light that does not reach what is seen, and the lens: against the reference, whatever finds the blocks, and by what
// anybody would expect of a shadow.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/renderer/compare.h"
#include "tests/renderer/pages_stage.h"
#include "tests/renderer/synthetic.h"
#include "tests/renderer/views.h"

namespace blockwalk::test {
namespace {

struct LightCase {
  const char* name;
  SyntheticOptions volume;
};

void PrintTo(const LightCase& light, std::ostream* out) { *out << light.name; }

// Where a rounding may send one of a pixel's rays another way nothing is compared.
reference::Image expectedOf(const reference::DenseVolume& dense, const View& view) {
  reference::Image expected = reference::renderImage(dense, view);
  for (reference::Pixel& pixel : expected.pixels) {
    if (view.filter != Filter::nearest) continue;
    const bool misses_cell = view.mode != Mode::blend && pixel.edge_distance < kNearEdge;
    if (pixel.face_distance < kNearEdge || misses_cell) pixel.margin = 0;
  }
  return expected;
}

class SecondaryTest : public RendererTest, public ::testing::WithParamInterface<LightCase> {
 protected:
  static std::vector<View> views(const Scene& scene, std::uint32_t seed, int count) {
    std::vector<View> chosen;
    for (View view : randomViews(scene.info, scene.dense(0), seed)) {
      if (view.width * view.height > 64 * 64) view.width = 64, view.height = 48;
      view.lit = true;
      chosen.push_back(view);
      if (static_cast<int>(chosen.size()) == count) break;
    }
    return chosen;
  }
  // Opaque enough that there are surfaces.
  static View opaque(View view) {
    view.extinction = 30;
    for (TransferPoint& point : view.channels[0].transfer) point.opacity = std::max(point.opacity, 0.5);
    return view;
  }
};

TEST_P(SecondaryTest, TakesAwayWhatTheReferenceTakesAway) {
  Scene scene = makeScene(*makeSynthetic(GetParam().volume));
  const reference::DenseVolume dense = scene.dense(0);
  for (const Mode mode : {Mode::blend, Mode::first_hit, Mode::iso}) {
    for (const Filter filter : {Filter::nearest, Filter::linear}) {
      ImageError total;
      std::size_t darker = 0;
      int number = 0;
      for (View view : views(scene, 61, 8)) {
        view = opaque(view);
        view.mode = mode;
        view.filter = filter;
        const Frame bright = draw(scene, view);
        view.shadow = number % 3 != 1;
        // No multiple of the step: where a ray ends on the lattice a rounding makes or unmakes its last sample.
        view.occlusion = number % 3 != 0 ? 6.3 : 0;
        view.lights = {.ambient = 0.5, .head = 0.1, .key = 0.6, .highlight = 0.1};
        view.key_light = number % 2 == 0 ? glm::dvec3(-1, 1, 1) : glm::dvec3(2, 0.5, -0.3);
        ++number;
        const reference::Image expected = expectedOf(dense, view);
        const double near_jump = kNearJump * dense.contrast;
        const Frame frame = draw(scene, view);
        const ImageError error = compareToReference(frame, expected, view.background, near_jump);
        EXPECT_LE(error.largest, kLargestError) << toString(view) << ": " << error.worst;
        total.add(error);
        View whole = view;
        whole.shadow = false;
        whole.occlusion = 0;
        const Frame lit = draw(scene, whole);
        for (std::size_t i = 0; i < lit.pixels.size(); ++i) {
          darker += (frame.pixels[i] & 0xff) + 8 < (lit.pixels[i] & 0xff) ? 1 : 0;
        }
      }
      EXPECT_GE(total.psnr(), kLeastPsnr);
      EXPECT_GT(darker, 200u) << "something is in the shade";
      EXPECT_LE(total.skipped * 6, total.channels) << "too much skipped";
    }
  }
}

TEST_P(SecondaryTest, IsTheSameWhateverFindsTheBlocks) {
  Scene scene = makeScene(*makeSynthetic(GetParam().volume));
  for (View view : views(scene, 62, 3)) {
    view = opaque(view);
    view.shadow = true;
    view.occlusion = 10;
    view.filter = Filter::linear;
    const std::vector<Combination> all = everyFinder();
    const Frame expected = draw(scene, with(view, all.front()));
    for (const Combination& combination : all) {
      EXPECT_EQ(draw(scene, with(view, combination)).pixels, expected.pixels) << toString(combination);
    }
  }
}

TEST_P(SecondaryTest, ALensIsTheReferences) {
  Scene scene = makeScene(*makeSynthetic(GetParam().volume));
  const reference::DenseVolume dense = scene.dense(0);
  ImageError total;
  std::size_t changed = 0;
  for (View view : views(scene, 63, 8)) {
    if (view.ortho_height) continue;
    view.lit = false;
    view.samples = 6;
    const Frame sharp = draw(scene, view);
    view.aperture = 3;
    const ImageError error =
        compareToReference(draw(scene, view), expectedOf(dense, view), view.background, kNearJump * dense.contrast);
    EXPECT_LE(error.largest, kLargestError) << toString(view) << ": " << error.worst;
    total.add(error);
    const Frame blurred = draw(scene, view);
    for (std::size_t i = 0; i < sharp.pixels.size(); ++i) changed += sharp.pixels[i] != blurred.pixels[i] ? 1 : 0;
  }
  EXPECT_GT(changed, 200u);
  EXPECT_GE(total.psnr(), kLeastPsnr);
}

INSTANTIATE_TEST_SUITE_P(
    Types, SecondaryTest,
    ::testing::Values(
        LightCase{"u8", {.type = VoxelType::u8, .dims = {50, 46, 40}, .seed = 4}},
        LightCase{"u16",
                  {.type = VoxelType::u16, .dims = {44, 40, 38}, .seed = 5, .world_from_index = obliqueMap(true)}},
        LightCase{"rgba8", {.type = VoxelType::rgba8, .dims = {40, 44, 42}, .seed = 7}}),
    [](const auto& test) { return std::string(test.param.name); });

// A plate across z = 0 and a ball over it, the light from straight above: what lies under the ball has no key light.
std::unique_ptr<Source> plateAndBall() {
  return makeVoxels(glm::ivec3(64), [](glm::ivec3 p) {
    const double away = glm::length(glm::dvec3(p) + 0.5 - glm::dvec3(32, 32, 40));
    return p.z < 6 || away < 8 ? 200 : 0;
  });
}

class ShadowTest : public PagesTest {
 protected:
  // From the side and above, with the light from above; a pixel is a unit.
  static View above() {
    View view = finest(64);
    view.mode = Mode::first_hit;
    view.eye = glm::dvec3(32, -100, 132);
    view.target = glm::dvec3(32, 32, 0);
    view.up = glm::dvec3(0, 0, 1);
    view.channels[0].transfer = {{.value = 100, .color = {1, 1, 1}, .opacity = 1}};
    view.lit = true;
    view.lights = {.ambient = 0, .head = 0, .key = 1, .highlight = 0};
    view.key_light = glm::dvec3(0, 1, 1);  // the view looks down at 45 degrees: straight up
    return view;
  }
};

TEST_F(ShadowTest, LiesUnderWhatIsLit) {
  Scene scene = makeScene(*plateAndBall());
  View view = above();
  const Frame bright = draw(scene, view);
  view.shadow = true;
  const Frame frame = draw(scene, view);
  view.output = Output::position;
  const Frame places = draw(scene, view);
  std::size_t under = 0, beside = 0;
  for (std::size_t i = 0; i < frame.pixels.size(); ++i) {
    const glm::dvec3 place(places.values[3 * i], places.values[3 * i + 1], places.values[3 * i + 2]);
    if (!(place.z > 5.9 && place.z < 6.1)) continue;  // on the plate
    const double away = glm::length(glm::dvec2(place) - glm::dvec2(32));
    if (away < 6) {
      ++under;
      EXPECT_EQ(frame.pixels[i] & 0xffffff, 0u);
      EXPECT_GT(bright.pixels[i] & 0xff, 200u);
    } else if (away > 10) {
      ++beside;
      EXPECT_EQ(frame.pixels[i], bright.pixels[i]);
    }
  }
  EXPECT_GT(under, 10u);
  EXPECT_GT(beside, 100u);
}

// Beside the ball the plate has less of the sky; away from all of it nothing is taken.
TEST_F(ShadowTest, OcclusionIsNearWhatOccludes) {
  Scene scene = makeScene(*plateAndBall());
  View view = above();
  view.lights = {.ambient = 1, .head = 0, .key = 0, .highlight = 0};
  view.samples = 16;
  const Frame bright = draw(scene, view);
  view.occlusion = 16;
  const Frame frame = draw(scene, view);
  const Frame again = draw(scene, view);
  EXPECT_EQ(frame.pixels, again.pixels);
  std::size_t darker = 0, same = 0;
  for (std::size_t i = 0; i < frame.pixels.size(); ++i) {
    EXPECT_LE(frame.pixels[i] & 0xff, bright.pixels[i] & 0xff);
    const std::uint32_t lost = (bright.pixels[i] & 0xff) - std::min(bright.pixels[i] & 0xff, frame.pixels[i] & 0xff);
    darker += lost > 20 ? 1 : 0;
    same += lost == 0 && (bright.pixels[i] & 0xff) > 0 ? 1 : 0;
  }
  EXPECT_GT(darker, 10u);
  EXPECT_GT(same, 30u);
}

TEST_F(ShadowTest, OfVoxelsThatComeAndGoIsThatOfAll) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::u8, .dims = {160, 150, 140}, .seed = 4}), kSmallBlocks);
  start(scene.path, 2560 * kKib);
  View view = finest(64);
  view.lit = view.shadow = true;
  view.occlusion = 20;
  for (const Filter filter : {Filter::nearest, Filter::linear}) {
    view.filter = filter;
    const auto [expected, frame] = drawBoth(scene, view);
    EXPECT_TRUE(frame.stats.paged);
    EXPECT_EQ(frame.stats.absent_blocks, 0u);
    EXPECT_EQ(frame.pixels, expected.pixels);
  }
}

TEST_F(ShadowTest, WhatIsNotAskedForIsNotCompiledIn) {
  Scene scene = makeScene(*plateAndBall());
  View view = above();
  const auto kernelOf = [&] { return draw(scene, view).stats.kernel; };
  EXPECT_EQ(kernelOf().find("secondary"), std::string::npos);
  view.shadow = true;
  EXPECT_NE(kernelOf().find("secondary"), std::string::npos);
  view.lights.key = 0;
  EXPECT_EQ(kernelOf().find("secondary"), std::string::npos);
  view.occlusion = 5;
  EXPECT_EQ(kernelOf().find("secondary"), std::string::npos) << "there is no ambient light to take away";
  view.lights.ambient = 0.5;
  EXPECT_NE(kernelOf().find("secondary"), std::string::npos);
  view.lit = false;
  EXPECT_EQ(kernelOf().find("secondary"), std::string::npos);
  view.aperture = 1;
  EXPECT_EQ(kernelOf().find("lens"), std::string::npos);
  view.samples = 2;
  EXPECT_NE(kernelOf().find("lens"), std::string::npos);
}

}  // namespace
}  // namespace blockwalk::test
