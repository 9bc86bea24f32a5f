// SPDX-License-Identifier: Apache-2.0
// One pixel of a picture alone, and what a frame knows of all of them: how many show something, and if none does, why.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/renderer/pages_stage.h"
#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"
#include "tests/renderer/views.h"

namespace blockwalk::test {
namespace {

// Of the picture `whole`, for pixels all over it: bit for bit its own.
struct PixelCount {
  std::size_t shown = 0;
  std::size_t coarse = 0;
};

void comparePixels(Renderer& renderer, ResidentVolume& volume, const View& view, const Frame& whole,
                   PixelCount& count) {
  const VolumeInfo& info = volume.info();
  for (int i = 0; i < 16; ++i) {
    const glm::ivec2 pixel(view.width / 5 + (i * 29 + 3) % std::max(view.width / 2, 1),
                           view.height / 4 + (i * 13 + 7) % std::max(view.height / 2, 1));
    FrameOrder order{.view = resolveView(view, info), .count = false, .probe = true, .pixel = pixel};
    const Frame frame = renderer.render(volume, order);
    ASSERT_EQ(frame.width, 1);
    ASSERT_EQ(frame.height, 1);
    const auto at = static_cast<std::size_t>(pixel.x + view.width * pixel.y);
    if (isPicture(view.output)) {
      ASSERT_EQ(frame.pixels.size(), 1u);
      EXPECT_EQ(frame.pixels[0], whole.pixels[at]) << toString(view);
      EXPECT_FALSE(frame.shown);
      continue;
    }
    ASSERT_EQ(frame.values.size(), 3u);
    const float* expected = &whole.values[3 * at];
    ASSERT_EQ(frame.shown.has_value(), !std::isnan(expected[0])) << toString(view) << ' ' << pixel.x << ' ' << pixel.y;
    EXPECT_EQ(frame.stats.drawn_pixels, frame.shown ? 1u : 0u);
    if (!frame.shown) continue;
    ++count.shown;
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(frame.values[static_cast<std::size_t>(axis)], expected[axis]) << toString(view);
      EXPECT_EQ(static_cast<float>(frame.shown->world[axis]), expected[axis]);
    }
    const Probe& probe = whole.probes[at];
    EXPECT_EQ(frame.probes[0].x, probe.x);
    EXPECT_EQ(frame.probes[0].t, probe.t);
    EXPECT_TRUE(glm::all(glm::greaterThanEqual(frame.shown->voxel, glm::ivec3(0))));
    EXPECT_TRUE(glm::all(glm::lessThan(frame.shown->voxel, info.dims)));
    if (probe.x >= 0) {
      EXPECT_NEAR(frame.shown->t, static_cast<double>(probe.t), 1e-5 * frame.shown->t);
      EXPECT_EQ(frame.shown->voxel >> frame.shown->level,
                (glm::ivec3(probe.x, probe.y, probe.z) << whole.stats.level) >> frame.shown->level)
          << toString(view);
    }
    if (frame.shown->level > 0) ++count.coarse;
    // The point lies in the voxel, or on its face.
    const glm::dvec3 index = glm::dvec3(glm::inverse(info.world_from_index) * glm::dvec4(frame.shown->world, 1));
    const double slack = 2e-3 * std::ldexp(1.0, frame.shown->level);
    EXPECT_TRUE(glm::all(glm::greaterThanEqual(index, glm::dvec3(frame.shown->voxel) - slack))) << toString(view);
    EXPECT_TRUE(glm::all(glm::lessThanEqual(index, glm::dvec3(frame.shown->voxel) + 1.0 + slack))) << toString(view);
  }
}

class PixelTest : public PagesTest {};

TEST_F(PixelTest, IsThatOfThePictureBitForBit) {
  Scene scene = makeScene(
      *makeSynthetic({.type = VoxelType::u8, .dims = {90, 81, 70}, .seed = 4, .world_from_index = obliqueMap(true)}));
  PixelCount count;
  int number = 0;
  for (View view : randomViews(scene.info, scene.dense(0), 47)) {
    view.mode = std::array{Mode::blend, Mode::first_hit, Mode::mip, Mode::iso}[static_cast<std::size_t>(number % 4)];
    view.filter = number % 3 == 0 ? Filter::linear : Filter::nearest;
    view.output = number % 5 == 0 ? Output::color : Output::position;
    ++number;
    comparePixels(renderer(), *scene.resident, view, draw(scene, view), count);
  }
  EXPECT_GT(count.shown, 50u);
}

TEST_F(PixelTest, KnowsTheLevelOfItsPart) {
  Scene scene = makeScene(*ball(200), kSmallBlocks);
  View view;
  view.width = 70;
  view.height = 50;
  view.mode = Mode::first_hit;
  view.lod = 1;
  view.eye = glm::dvec3(100, 130, 230);
  view.target = glm::dvec3(100, 100, 60);
  view.fov_degrees = 70;
  view.output = Output::position;
  PixelCount count;
  const Frame whole = draw(scene, view);
  comparePixels(renderer(), *scene.resident, view, whole, count);
  EXPECT_GT(count.shown, 5u);
  view.level = 1;
  comparePixels(renderer(), *scene.resident, view, draw(scene, view), count);
  EXPECT_GT(count.coarse, 5u);
}

TEST_F(PixelTest, BringsInWhatItsRayComesTo) {
  Scene scene = makeScene(*ball(120), kSmallBlocks);
  start(scene.path, 640 * kKib);
  View view = finest(64);
  view.mode = Mode::first_hit;
  view.channels[0].range = DensityRange{100, 255};
  view.output = Output::position;
  PixelCount count;
  comparePixels(*renderer_, *volume_, view, draw(scene, view), count);
  EXPECT_GT(count.shown, 4u);
}

TEST_F(PixelTest, ThoseThatShowSomethingAreCounted) {
  Scene scene = makeScene(*ball(60));
  View view;
  view.width = 61;
  view.height = 47;
  view.channels[0].transfer = {{.value = 100, .color = {1, 0.5, 0.25}, .opacity = 0.25}};
  view.output = Output::depth;
  const std::uint64_t shown = draw(scene, view).stats.drawn_pixels;
  view.output = Output::position;
  EXPECT_EQ(draw(scene, view).stats.drawn_pixels, shown);
  view.output = Output::color;
  std::uint64_t covered = 0;
  for (const auto& background :
       {std::array<std::uint8_t, 4>{0, 0, 0, 0}, {0, 0, 0, 255}, {9, 200, 77, 255}, {9, 200, 77, 40}}) {
    view.background = background;
    for (const int samples : {1, 3}) {
      view.samples = samples;
      const Frame frame = draw(scene, view);
      if (samples == 1 && covered == 0) covered = frame.stats.drawn_pixels;
      EXPECT_NEAR(static_cast<double>(frame.stats.drawn_pixels), static_cast<double>(covered), samples == 1 ? 0 : 300);
      EXPECT_GE(frame.stats.drawn_pixels, shown);
      EXPECT_LT(frame.stats.drawn_pixels, 61u * 47);
      EXPECT_THAT(frame.stats.reasons, testing::IsEmpty());
    }
  }
  for (const Output output : {Output::color, Output::depth, Output::cost}) {
    view.output = output;
    view.samples = 1;
    view.channels[0].range = DensityRange{201, 255};
    EXPECT_EQ(draw(scene, view).stats.drawn_pixels, 0u);
    EXPECT_EQ(draw(scene, view).stats.reasons.at(0).name, "range");
    view.channels[0].range.reset();
    view.planes = {{{1, 0, 0}, -1000}};
    EXPECT_EQ(draw(scene, view).stats.drawn_pixels, 0u);
    EXPECT_EQ(draw(scene, view).stats.reasons.at(0).name, "clip");
    view.planes.clear();
  }
  // The ball's corner of the box.
  view.output = Output::color;
  view.eye = glm::dvec3(0, 0, 200);
  view.target = glm::dvec3(0, 0, 0);
  view.fov_degrees = 0.5;
  EXPECT_EQ(draw(scene, view).stats.reasons.at(0).name, "unseen");
}

TEST_F(PixelTest, AFrameThatIsCoarserSaysWhy) {
  start(buildFile(*ball(200), kSmallBlocks), 1024 * kKib);
  const View view = finest(64);
  const Frame moving = drawAsItIs(view);
  ASSERT_GT(moving.stats.absent_blocks, 0u);
  EXPECT_EQ(moving.stats.reasons.at(0).name, "loading");
  // Of a solid ball behind glass all is seen, and finds no room.
  View glass = view;
  glass.channels[0].transfer = {{.value = 0, .color = {1, 1, 1}, .opacity = 0.001}};
  glass.ortho_height = 20;
  glass.width = glass.height = 16;
  const Frame frame = renderer_->render(*volume_, orderOf(glass));
  if (frame.stats.isComplete()) {
    EXPECT_THAT(frame.stats.reasons, testing::IsEmpty());
  } else {
    EXPECT_EQ(frame.stats.reasons.at(0).name, "level");
    EXPECT_THAT(frame.stats.reasons.at(0).detail, testing::HasSubstr("are there"));
  }
}

}  // namespace
}  // namespace blockwalk::test
