// SPDX-License-Identifier: Apache-2.0
// Outputs other than color: depth and position of the point shown, and cost (docs/integration.md, "Outputs"), against
// the float64 reference and, for every finder, walk and cull, against each other.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/reference/analytic.h"
#include "tests/reference/cut_ray.h"
#include "tests/reference/field.h"
#include "tests/renderer/compare.h"
#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"
#include "tests/renderer/views.h"

namespace blockwalk::test {
namespace {

constexpr double kDensityError = 1e-5;  // of the contrast, at a crossing
constexpr double kFloat = 2e-7;

struct PointError {
  std::size_t pixels = 0;
  std::size_t shown = 0;
  std::size_t excused = 0;  // wrong where rounding alone may decide
  std::size_t wrong = 0;
  std::string worst{};
};

// What a depth image is held to.
class PointJudge {
 public:
  PointJudge(const Scene& scene, const reference::DenseVolume& dense, const View& view)
      : dense_(dense), view_(view), expected_(reference::renderImage(dense, view)), voxel_(unitDistance(scene.info)) {
    forward_ = glm::normalize(view.target.value() - view.eye.value());
  }

  PointError judge(const Frame& frame) const {
    PointError error{.pixels = frame.values.size()};
    for (int y = 0; y < view_.height; ++y) {
      for (int x = 0; x < view_.width; ++x) judgePixel(frame, x, y, error);
    }
    return error;
  }

 private:
  void judgePixel(const Frame& frame, int x, int y, PointError& error) const {
    const auto at = static_cast<std::size_t>(y * view_.width + x);
    const reference::Pixel& pixel = expected_.pixels[at];
    const auto depth = static_cast<double>(frame.values[at]);
    const reference::Ray ray = reference::worldRay(view_, x, y);
    error.shown += pixel.shows_point ? 1 : 0;
    const double t = depth / glm::dot(ray.direction, forward_);
    if (isRight(t, pixel, reference::indexRay(dense_, ray)) || isAsLow(t, pixel, x, y)) return;
    if (isExcused(pixel)) {
      ++error.excused;
      return;
    }
    ++error.wrong;
    error.worst = fmt::format("pixel ({},{}): depth {:.9g} against t {:.9g} ({:.9g}..{:.9g}), shown {}", x, y, depth,
                              pixel.t, pixel.t_early, pixel.t_late, pixel.shows_point);
  }

  bool isRight(double t, const reference::Pixel& pixel, const reference::Ray& index_ray) const {
    const double slack = 1e-3 * voxel_ + kFloat * (std::abs(pixel.t) + 1);
    if (view_.mode == Mode::blend) {
      return std::isinf(t) ? std::isinf(pixel.t_late) : t >= pixel.t_early - slack && t <= pixel.t_late + slack;
    }
    if (std::isinf(t) || !pixel.shows_point) return std::isinf(t) && !pixel.shows_point;
    if (view_.mode == Mode::mip && view_.filter == Filter::linear && std::abs(t - pixel.t) > slack) {
      // Of samples that are equal but for rounding any may be the largest.
      const double density = dense_.value_offset + dense_.value_scale * fieldAt(dense_, index_ray.at(t)).w;
      return std::abs(density - pixel.value) <= 1e-4 * std::abs(dense_.contrast * dense_.value_scale);
    }
    const double crossing =
        pixel.slope != 0 && !pixel.at_entry ? kDensityError * dense_.contrast / std::abs(pixel.slope) : 0;
    return std::abs(t - pixel.t) <= slack + crossing;
  }

  // minip: a sample at t has the value shown but for rounding.
  bool isAsLow(double t, const reference::Pixel& pixel, int x, int y) const {
    if (view_.mode != Mode::minip || view_.filter != Filter::linear || std::isinf(t) || !pixel.shows_point)
      return false;
    const double reach = 0.1 * view_.step * voxel_;
    const reference::Pixel sample =
        reference::renderPixel(dense_, view_, x, y, reference::kPixelCentre, {.t_min = t - reach, .t_max = t + reach});
    return std::abs(sample.value - pixel.value) <= 1e-4 * std::abs(dense_.contrast * dense_.value_scale);
  }

  bool isExcused(const reference::Pixel& pixel) const {
    if (view_.filter == Filter::nearest) return std::min(pixel.edge_distance, pixel.face_distance) < kNearEdge;
    return pixel.margin < kNearJump * dense_.contrast || pixel.edge_distance < kNearEdge ||
           pixel.lattice_distance < 1e-3;
  }

  const reference::DenseVolume& dense_;
  View view_;
  reference::Image expected_;
  glm::dvec3 forward_{0};
  double voxel_;
};

class OutputsTest : public RendererTest {
 protected:
  static std::vector<Combination> two() {
    const std::vector<Combination> all = combinations();
    return {all.front(), all.back()};
  }

  static void expectPoints(Scene& scene, const std::vector<Mode>& modes, View look,
                           const std::vector<Combination>& choices) {
    const reference::DenseVolume dense = scene.dense(0);
    for (Mode mode : modes) {
      PointError total;
      for (View view : randomViews(scene.info, dense, 41)) {
        view.mode = mode;
        view.filter = look.filter;
        view.classification = look.classification;
        view.extinction *= 2;
        view.output = Output::depth;
        const PointJudge judge(scene, dense, view);
        for (const Combination& choice : choices) {
          const PointError error = judge.judge(draw(scene, with(view, choice)));
          EXPECT_EQ(error.wrong, 0u) << toString(choice) << ", view " << toString(view) << ": " << error.worst;
          total.pixels += error.pixels;
          total.shown += error.shown;
          total.excused += error.excused;
        }
      }
      EXPECT_GT(total.shown * 20, total.pixels) << "too little to see in mode " << static_cast<int>(mode);
      EXPECT_LE(total.excused * 200, total.pixels) << "mode " << static_cast<int>(mode);
      std::printf("mode %d: %zu points, %zu excused\n", static_cast<int>(mode), total.shown, total.excused);
    }
  }
};

// Closed forms, for the reference.
TEST(Outputs, HalfTheOpacityIsWhereTheFormulaSays) {
  using namespace reference;
  DenseVolume volume = sampled(constantField(80), VoxelType::u8, glm::ivec3(12));
  volume.type = VoxelType::rgba8;
  volume.color.assign(volume.density.size(), {255, 128, 0});
  const double extinction = 0.3 * 80 / 255;
  for (Filter filter : {Filter::nearest, Filter::linear}) {
    View view = linearView({3.3, 4.4, 30}, {3.3, 4.4, 0});
    view.filter = filter;
    Pixel pixel = renderPixel(volume, view, 0, 0);
    EXPECT_NEAR(pixel.t, 18 + std::numbers::ln2 / extinction, 1e-9);
    EXPECT_NEAR(pixel.t_late - pixel.t, kHalfMargin / extinction, 1e-9);
    EXPECT_NEAR(pixel.t - pixel.t_early, kHalfMargin / extinction, 1e-9);
    view.planes = {{{0, 0, -1}, 10.25}};
    EXPECT_NEAR(renderPixel(volume, view, 0, 0).t, 19.75 + std::numbers::ln2 / extinction, 1e-9);
    view.planes = {{{0, 0, -1}, std::numbers::ln2 / extinction - 1e-6}};
    pixel = renderPixel(volume, view, 0, 0);
    EXPECT_FALSE(pixel.shows_point);
    EXPECT_TRUE(std::isinf(pixel.t_late));
    EXPECT_NEAR(pixel.t_early, 30 - kHalfMargin / extinction, 1e-4);
  }
}

TEST_F(OutputsTest, HalfTheOpacityIsWhereTheReferenceSays) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::rgba8, .dims = {70, 64, 57}}));
  expectPoints(scene, {Mode::blend}, {}, combinations());
}

TEST_F(OutputsTest, VoxelsHitAndLargestVoxelsAreWhereTheReferenceSays) {
  Scene scene = makeScene(
      *makeSynthetic({.type = VoxelType::f32, .dims = {64, 51, 70}, .seed = 4, .world_from_index = obliqueMap(true)}));
  expectPoints(scene, {Mode::first_hit, Mode::mip, Mode::minip, Mode::attenuated_mip}, {}, two());
}

TEST_F(OutputsTest, SurfacesOfTheFieldAreWhereTheReferenceSays) {
  Scene scene = makeScene(
      *makeSynthetic({.type = VoxelType::u16, .dims = {61, 70, 49}, .seed = 3, .world_from_index = obliqueMap(false)}));
  View linear;
  linear.filter = Filter::linear;
  expectPoints(scene, {Mode::iso}, linear, combinations());
  expectPoints(scene, {Mode::blend, Mode::first_hit, Mode::mip, Mode::minip, Mode::attenuated_mip}, linear, two());
  linear.classification = Classification::pre_integrated;
  expectPoints(scene, {Mode::blend}, linear, {Combination{}});
}

TEST_F(OutputsTest, PositionsLieOnTheRaysAtTheDepthShown) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::rgba8, .dims = {70, 64, 57}}));
  std::size_t points = 0;
  for (View view : randomViews(scene.info, scene.dense(0), 42)) {
    view.mode = Mode::first_hit;
    view.output = Output::depth;
    const Frame depth = draw(scene, view);
    view.output = Output::position;
    const Frame position = draw(scene, view);
    const glm::dvec3 forward = glm::normalize(*view.target - *view.eye);
    for (std::size_t i = 0; i < depth.values.size(); ++i) {
      const glm::dvec3 point(position.values[3 * i], position.values[3 * i + 1], position.values[3 * i + 2]);
      if (std::isinf(depth.values[i])) {
        EXPECT_TRUE(std::isnan(point.x) && std::isnan(point.y) && std::isnan(point.z));
        continue;
      }
      ++points;
      const auto width = static_cast<std::size_t>(view.width);
      const reference::Ray ray = reference::worldRay(view, static_cast<int>(i % width), static_cast<int>(i / width));
      const double t = static_cast<double>(depth.values[i]) / glm::dot(ray.direction, forward);
      // A depth is a float, and so is each coordinate.
      EXPECT_LT(glm::length(ray.at(t) - point), kFloat * (t + glm::length(point))) << i << ' ' << toString(view);
    }
  }
  EXPECT_GT(points, 10000u);
}

TEST_F(OutputsTest, CostsAddUpToTheFramesCounters) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::rgba8, .dims = {70, 64, 57}}));
  View view = randomViews(scene.info, scene.dense(0), 43)[10];
  for (const Combination& combination : combinations()) {
    view.output = Output::cost;
    const Frame frame = draw(scene, with(view, combination));
    double sum = 0;
    for (float cost : frame.values) sum += static_cast<double>(cost);
    const RenderStats& stats = frame.stats;
    EXPECT_EQ(sum, static_cast<double>(stats.block_visits + stats.subblock_visits + stats.voxel_steps));
    EXPECT_GT(sum, 0);
    const Frame uncounted = renderer().render(*scene.resident, with(view, combination), {.count = false});
    EXPECT_EQ(uncounted.values, frame.values) << toString(combination);
    view.output = Output::color;
    EXPECT_EQ(draw(scene, with(view, combination)).stats.voxel_steps, stats.voxel_steps);
  }
}

TEST_F(OutputsTest, QueriesAddUpToTheFramesCounter) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::rgba8, .dims = {70, 64, 57}}));
  View view = randomViews(scene.info, scene.dense(0), 43)[10];
  view.output = Output::queries;
  for (const Combination& combination : everyFinder()) {
    const Frame frame = draw(scene, with(view, combination));
    double sum = 0;
    for (float queries : frame.values) sum += static_cast<double>(queries);
    EXPECT_EQ(sum, static_cast<double>(frame.stats.queries)) << toString(combination);
    EXPECT_EQ(sum > 0, combination.finder != Finder::none) << toString(combination);
  }
}

// Without culling a ray pays for every stored block and subblock that it crosses and every voxel in those.
TEST_F(OutputsTest, CostsAreWhatTheReferenceCounts) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::rgba8, .dims = {70, 64, 57}}));
  const reference::DenseVolume dense = scene.dense(0);
  std::vector<bool> stored(static_cast<std::size_t>(9 * 8 * 8));
  const auto subblockAt = [](glm::ivec3 cell) { return static_cast<std::size_t>(cell.x + 9 * (cell.y + 8 * cell.z)); };
  for (int v = 0; v < 70 * 64 * 57; ++v) {
    const glm::ivec3 voxel(v % 70, v / 70 % 64, v / (70 * 64));
    if (!reference::isEmpty(dense, dense.density[dense.at(voxel)])) stored[subblockAt(voxel / 8)] = true;
  }
  std::size_t compared = 0;
  for (View view : randomViews(scene.info, dense, 44)) {
    if (view.channels[0].range->lo > static_cast<double>(scene.info.channels[0].density_max))
      continue;  // nothing to see, nothing to pay
    view.mode = Mode::mip;
    view.output = Output::cost;
    const reference::Image near = reference::renderImage(dense, view);
    for (const Combination& combination : two()) {
      const Frame frame =
          draw(scene, with(view, {.finder = combination.finder, .walk = combination.walk, .cull = false}));
      for (std::size_t i = 0; i < frame.values.size(); ++i) {
        if (std::min(near.pixels[i].edge_distance, near.pixels[i].face_distance) < kNearEdge) continue;
        const auto width = static_cast<std::size_t>(view.width);
        const reference::CutRay cut =
            reference::cutRay(dense, view, static_cast<int>(i % width), static_cast<int>(i / width));
        int cost = 0;
        reference::walkCells(cut.ray, 48, cut.interval, [&](glm::ivec3 cell, reference::Interval) {
          cost += dense.blocks[dense.blockAt(cell)].stored ? 1 : 0;
          return true;
        });
        for (int side : {8, 1}) {
          reference::walkCells(cut.ray, side, cut.interval, [&](glm::ivec3 cell, reference::Interval) {
            cost += stored[subblockAt(side == 8 ? cell : cell / 8)] ? 1 : 0;
            return true;
          });
        }
        EXPECT_EQ(frame.values[i], static_cast<float>(cost)) << i << ' ' << toString(view);
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 100000u);
}

TEST_F(OutputsTest, NothingIsInfinityNotANumberAndZero) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::rgba8, .dims = {40, 40, 40}}));
  for (const bool blank : {true, false}) {
    View view;
    view.width = 9;
    view.height = 7;
    if (blank) view.channels[0].range = DensityRange{.lo = 300, .hi = 400};
    if (!blank) view.planes = {{{1, 0, 0}, -1000}};
    view.output = Output::depth;
    for (float depth : draw(scene, view).values) EXPECT_EQ(depth, std::numeric_limits<float>::infinity());
    view.output = Output::position;
    for (float position : draw(scene, view).values) EXPECT_TRUE(std::isnan(position));
    for (Output count : {Output::cost, Output::queries}) {
      view.output = count;
      for (float number : draw(scene, view).values) EXPECT_EQ(number, 0);
    }
  }
}

TEST_F(OutputsTest, AModeWithoutAPointHasNoDepth) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::rgba8, .dims = {40, 40, 40}}));
  for (Mode mode : {Mode::mean, Mode::blocks}) {
    for (Output output : {Output::depth, Output::position}) {
      View view;
      view.mode = mode;
      view.output = output;
      try {
        renderer().render(*scene.resident, view, {});
        ADD_FAILURE() << "was drawn";
      } catch (const ViewError& error) {
        EXPECT_EQ(error.field, "output");
      }
    }
    View view;
    view.mode = mode;
    view.output = Output::cost;
    EXPECT_GT(draw(scene, view).stats.block_visits, 0u);
  }
}

}  // namespace
}  // namespace blockwalk::test
