// SPDX-License-Identifier: Apache-2.0
#include "tests/extreme/gauge.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/extreme/volumes.h"
#include "tests/renderer/compare.h"
#include "tests/renderer/stage.h"

namespace blockwalk::extreme {
namespace {

struct Stage : test::RendererTest {
  using RendererTest::draw;
  using RendererTest::everyFinder;
  using RendererTest::makeScene;
  using RendererTest::with;
};

constexpr double kDepthPrecision = 1e-6;  // relative, of the bisection

// A built scenario: resident, its view resolved, with the dense volume that the reference looks at.
struct Built {
  test::Scene scene;
  View view;
  reference::DenseVolume dense;
};

Built build(const Scenario& scenario) {
  Built built{.scene = Stage::makeScene(*scenario.source, scenario.build), .view = {}, .dense = {}};
  View view = scenario.view;
  if (view.level == kAutoLevel) view.level = 0;
  built.view = spellOut(resolveView(view, built.scene.info));
  built.dense = scenario.reference ? *scenario.reference : built.scene.dense(view.level);
  return built;
}

double channel(std::uint32_t pixel, int c) { return static_cast<double>(pixel >> (8 * c) & 255u); }

double pixelError(std::uint32_t drawn, const glm::dvec4& expected) {
  double error = std::abs(channel(drawn, 3) - 255 * expected.a);
  for (int c = 0; c < 3; ++c) {
    error = std::max(error, expected.a * std::abs(channel(drawn, c) - 255 * expected[c]));
  }
  return error;
}

double frameError(const Frame& frame, const reference::Image& expected) {
  double error = 0;
  for (std::size_t i = 0; i < expected.pixels.size(); ++i) {
    error = std::max(error, pixelError(frame.pixels[i], expected.pixels[i].color));
  }
  return error;
}

bool showsSomething(const reference::Image& image, const View& view) {
  return std::ranges::any_of(image.pixels, [&](const reference::Pixel& pixel) {
    return reference::roundColor(pixel.color) != view.background;
  });
}

}  // namespace

Scenario clumpScenario(const View& view) {
  Scenario scenario{.source = clumps(VoxelType::rgba8, {56, 54, 52}), .view = view};
  scenario.view.channels[0].range = DensityRange{.lo = 60, .hi = 255};
  return scenario;
}

double imageError(const Scenario& scenario) {
  Built built = build(scenario);
  double largest = 0;
  for (Filter filter : scenario.filters) {
    built.view.filter = filter;
    const reference::Image expected = reference::renderImage(built.dense, built.view);
    EXPECT_EQ(showsSomething(expected, built.view), !scenario.blank);
    for (const test::Combination& combination : Stage::everyFinder()) {
      const Frame frame = Stage::draw(built.scene, Stage::with(built.view, combination));
      const double error = frameError(frame, expected);
      if (error > largest && error > 1) {
        std::printf("  %s filter %s: %.3f, %s\n", test::toString(combination).c_str(),
                    filter == Filter::nearest ? "nearest" : "linear", error,
                    test::compareToReference(frame, expected, built.view.background).worst.c_str());
      }
      largest = std::max(largest, error);
    }
  }
  return largest;
}

double wrongHits(const Scenario& scenario) {
  Built built = build(scenario);
  built.view.mode = Mode::first_hit;
  std::size_t wrong = 0;
  for (Filter filter : scenario.filters) {
    built.view.filter = filter;
    const reference::Image expected = reference::renderImage(built.dense, built.view);
    const auto is_hit = [](const reference::Pixel& pixel) { return pixel.voxel.x >= 0; };
    EXPECT_EQ(std::ranges::any_of(expected.pixels, is_hit), !scenario.blank);
    for (const test::Combination& combination : Stage::everyFinder()) {
      const Frame frame = Stage::draw(built.scene, Stage::with(built.view, combination));
      const test::ProbeError error = test::compareHits(frame, expected, 1 / unitDistance(built.scene.info));
      EXPECT_EQ(error.unexcused, 0u) << test::toString(combination) << ": " << error.worst;
      wrong += error.unexcused;
    }
  }
  return static_cast<double>(wrong);
}

double depthError(const DepthScenario& depth) {
  Built built = build(depth.scenario);
  built.view.width = built.view.height = 1;
  const std::uint8_t behind = depth.dark ? 255 : 0;
  built.view.background = {behind, behind, behind, 255};
  const auto depthOf = [&](double red) { return depth.dark ? -std::log(red) : -std::log1p(-red); };
  const double expected = depthOf((depth.byte + 0.5) / 255);
  double largest = 0;
  for (Filter filter : depth.scenario.filters) {
    built.view.filter = filter;
    for (const test::Combination& combination : Stage::everyFinder()) {
      double lo = std::log(depth.lo), hi = std::log(depth.hi);
      View view = Stage::with(built.view, combination);
      while (hi - lo > kDepthPrecision) {
        const double middle = 0.5 * (lo + hi);
        depth.set_strength(view, std::exp(middle));
        const bool above = channel(Stage::draw(built.scene, view).pixels[0], 0) > depth.byte;
        (above != depth.dark ? hi : lo) = middle;
      }
      depth.set_strength(view, std::exp(0.5 * (lo + hi)));
      const double red = reference::renderPixel(built.dense, view, 0, 0).color.r;
      const double error = std::abs(depthOf(red) / expected - 1);
      largest = std::isfinite(error) ? std::max(largest, error) : error;
    }
  }
  return largest;
}

double isNotRefused(const Scenario& scenario, const std::string& field) {
  const test::Scene scene = Stage::makeScene(*scenario.source, scenario.build);
  try {
    resolveView(scenario.view, scene.info);
  } catch (const ViewError& error) {
    EXPECT_EQ(error.field, field) << error.what();
    return error.field == field ? 0 : 1;
  }
  return 1;
}

}  // namespace blockwalk::extreme
