// SPDX-License-Identifier: Apache-2.0
// The mean of the converged integral over a pixel's area against closed forms.
#include "tests/reference/pixel_mean.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/reference/analytic.h"

namespace blockwalk::reference {
namespace {

// u8, a constant opacity over the unit distance of 1/4, seen along -z; a pixel 2 voxels wide, 3..5 in x, 4..6 in y.
struct Slab {
  DenseVolume volume = sampled(constantField(100), VoxelType::u8, glm::ivec3(8));
  View view = linearView({4, 5, 30}, {4, 5, 0});
  double sigma = -std::log(0.75);

  Slab() {
    view.up = glm::dvec3(0, 1, 0);
    view.ortho_height = 2;
    view.channels[0].transfer = transferRamp(0, 0.25, 255, 0.25);
  }
  double mean() const { return renderPixelMean(volume, view, 0, 0).color.a; }
};

TEST(PixelMean, OfAWedgeIsItsIntegral) {
  Slab slab;
  // Below z = x: the way through is x, for x from 3 to 5.
  slab.view.planes = {{{1, 0, -1}, 0}};
  const double s = slab.sigma;
  const double expected = 1 - (std::exp(-3 * s) - std::exp(-5 * s)) / (2 * s);
  EXPECT_NEAR(slab.mean(), expected, kMeanTolerance);
  EXPECT_GT(std::abs(expected + std::expm1(-4 * s)), kMeanTolerance) << "the centre's ray would do as well";
}

TEST(PixelMean, OfAnEdgeIsItsShare) {
  Slab slab;
  const double opacity = -std::expm1(-8 * slab.sigma);
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> number(0, 1);
  double squares = 0;
  constexpr int kEdges = 60;
  for (int edge = 0; edge < kEdges; ++edge) {
    const double angle = 2 * std::numbers::pi * number(generator);
    const glm::dvec3 normal(std::cos(angle), std::sin(angle), 0);
    const glm::dvec3 through(3 + 2 * number(generator), 4 + 2 * number(generator), 0);
    slab.view.planes = {{normal, -glm::dot(normal, through)}};
    // Line by line: along x a plane leaves a stretch.
    constexpr int kLines = 10000;
    double share = 0;
    for (int k = 0; k < kLines; ++k) {
      const double y = 4 + 2 * (k + 0.5) / kLines;
      const double x = std::clamp(through.x - normal.y / normal.x * (y - through.y), 3.0, 5.0);
      share += (normal.x > 0 ? 5 - x : x - 3) / 2 / kLines;
    }
    const double error = (slab.mean() - share * opacity) / opacity;
    EXPECT_LT(std::abs(error), 1.0 / 40) << angle;
    squares += error * error;
  }
  EXPECT_LT(std::sqrt(squares / kEdges), 1.0 / 150);
}

TEST(PixelMean, OfOneColourIsThatColour) {
  Slab slab;
  const Pixel mean = renderPixelMean(slab.volume, slab.view, 0, 0);
  EXPECT_NEAR(mean.color.a, -std::expm1(-8 * slab.sigma), 1e-9);
  EXPECT_NEAR(mean.color.r + mean.color.b, 1, 1e-9) << "red to blue";
}

}  // namespace
}  // namespace blockwalk::reference
