// SPDX-License-Identifier: Apache-2.0
// Output value: the density of the point shown, the largest or the mean, against the float64 reference.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/renderer/compare.h"
#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"
#include "tests/renderer/views.h"

namespace blockwalk::test {
namespace {

struct ValueError {
  std::size_t pixels = 0;
  std::size_t shown = 0;
  std::size_t excused = 0;  // wrong where rounding alone may decide
  std::size_t wrong = 0;
  std::string worst{};
};

class ValueTest : public RendererTest {
 protected:
  // How far a value may be from the truth, data units.
  static double slackOf(const reference::DenseVolume& dense, const View& view) {
    const double contrast = std::abs(dense.contrast * dense.value_scale);
    const bool is_stored = view.mode != Mode::mean && view.mode != Mode::attenuated_mip;
    if (view.filter == Filter::nearest) return is_stored ? 1e-6 * contrast : 1e-4 * contrast;
    // Of a surface the place is known to a thousandth of a voxel.
    return (view.mode == Mode::first_hit || view.mode == Mode::iso ? 3e-3 : 2e-4) * contrast;
  }

  static bool isRight(double value, const reference::Pixel& pixel, const View& view, double slack) {
    const auto is = [&](double truth) {
      return std::isnan(truth) ? std::isnan(value) : std::abs(value - truth) <= slack;
    };
    if (view.mode != Mode::blend) return is(pixel.value);
    return is(pixel.value) || is(pixel.value_early) || is(pixel.value_late);
  }

  static bool isExcused(const reference::Pixel& pixel, const reference::DenseVolume& dense, const View& view) {
    if (view.filter == Filter::nearest) return std::min(pixel.edge_distance, pixel.face_distance) < kNearEdge;
    return pixel.margin < kNearJump * dense.contrast || pixel.edge_distance < kNearEdge ||
           pixel.lattice_distance < 1e-3;
  }

  static void expectValues(Scene& scene, const std::vector<Mode>& modes, const View& look,
                           const std::vector<Combination>& choices) {
    const reference::DenseVolume dense = scene.dense(0);
    for (const Mode mode : modes) {
      ValueError total;
      for (View view : randomViews(scene.info, dense, 48)) {
        view.mode = mode;
        view.filter = look.filter;
        view.classification = look.classification;
        view.extinction *= 2;
        view.output = Output::value;
        const reference::Image expected = reference::renderImage(dense, view);
        for (const Combination& choice : choices) {
          const Frame frame = draw(scene, with(view, choice));
          std::uint64_t drawn = 0;
          for (std::size_t i = 0; i < frame.values.size(); ++i) {
            const reference::Pixel& pixel = expected.pixels[i];
            const auto value = static_cast<double>(frame.values[i]);
            drawn += std::isnan(value) ? 0 : 1;
            ++total.pixels;
            total.shown += std::isnan(pixel.value) ? 0 : 1;
            if (isRight(value, pixel, view, slackOf(dense, view))) continue;
            const bool excused = isExcused(pixel, dense, view);
            ++(excused ? total.excused : total.wrong);
            if (!excused) {
              total.worst = fmt::format("{}: {} against {} ({}, {}) in {}", i, value, pixel.value, pixel.value_early,
                                        pixel.value_late, toString(view));
            }
          }
          EXPECT_EQ(frame.stats.drawn_pixels, drawn);
        }
      }
      EXPECT_EQ(total.wrong, 0u) << "mode " << static_cast<int>(mode) << ' ' << total.worst;
      EXPECT_GT(total.shown * 20, total.pixels) << "too little to see in mode " << static_cast<int>(mode);
      EXPECT_LE(total.excused * 200, total.pixels) << "mode " << static_cast<int>(mode);
      std::printf("mode %d: %zu values, %zu excused\n", static_cast<int>(mode), total.shown, total.excused);
    }
  }

  static std::vector<Combination> two() {
    const std::vector<Combination> all = combinations();
    return {all.front(), all.back()};
  }
};

TEST_F(ValueTest, VoxelsHaveWhatTheReferenceSays) {
  Scene scene = makeScene(
      *makeSynthetic({.type = VoxelType::f32, .dims = {64, 51, 70}, .seed = 4, .world_from_index = obliqueMap(true)}));
  expectValues(scene,
               {Mode::blend, Mode::first_hit, Mode::mip, Mode::minip, Mode::attenuated_mip, Mode::mean, Mode::iso}, {},
               two());
}

TEST_F(ValueTest, TheFieldHasWhatTheReferenceSays) {
  Scene scene = makeScene(
      *makeSynthetic({.type = VoxelType::u16, .dims = {61, 70, 49}, .seed = 3, .world_from_index = obliqueMap(false)}));
  View linear;
  linear.filter = Filter::linear;
  expectValues(scene,
               {Mode::blend, Mode::first_hit, Mode::mip, Mode::minip, Mode::attenuated_mip, Mode::mean, Mode::iso},
               linear, {Combination{}});
  linear.classification = Classification::pre_integrated;
  expectValues(scene, {Mode::blend}, linear, {Combination{}});
}

TEST_F(ValueTest, DensitiesOfColouredVoxels) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::rgba8, .dims = {70, 64, 57}}));
  expectValues(scene, {Mode::blend, Mode::first_hit, Mode::mip, Mode::minip, Mode::attenuated_mip}, {},
               {Combination{}});
}

TEST_F(ValueTest, IsOfOneChannelAndOfDensities) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::u8, .dims = {40, 40, 40}, .channels = 2}));
  View view;
  view.width = view.height = 20;
  view.output = Output::value;
  const auto refusedFor = [&] {
    try {
      renderer().render(*scene.resident, view, {});
    } catch (const ViewError& error) {
      return error.field;
    }
    return std::string();
  };
  EXPECT_EQ(refusedFor(), "output");
  view.drawn = {1};
  EXPECT_EQ(refusedFor(), "");
  view.mode = Mode::blocks;
  EXPECT_EQ(refusedFor(), "output");
  view.mode = Mode::mip;
  view.channels[1].range = DensityRange{1e6, 2e6};
  for (const float value : draw(scene, view).values) EXPECT_TRUE(std::isnan(value));
}

}  // namespace
}  // namespace blockwalk::test
