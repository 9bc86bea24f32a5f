// SPDX-License-Identifier: Apache-2.0
// The reference's blend through the linear filter against closed forms: the converged integral, pre-integration, and
// the order of the lattice's midpoint rule.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "tests/reference/converged.h"
#include "tests/reference/quadrature.h"
#include "tests/reference/ray.h"
#include "tests/renderer/closed_forms.h"

namespace blockwalk::reference {
namespace {

glm::dvec4 lattice(const DenseVolume& volume, const View& view) { return renderPixel(volume, view, 0, 0).color; }
glm::dvec4 converged(const DenseVolume& volume, const View& view) {
  return renderPixelConverged(volume, view, 0, 0).color;
}
double depthOf(double opacity) { return -std::log1p(-opacity); }

const ClipBox kInterior{.min = {-100, -100, 1}, .max = {100, 100, 7}};

DenseVolume randomBytes(glm::ivec3 dims, std::uint32_t seed) {
  std::mt19937 random(seed);
  DenseVolume volume = emptyVolume(VoxelType::u8, dims);
  for (float& density : volume.density) density = static_cast<float>(random() % 256);
  return volume;
}

// Root of the mean square difference of two images, all channels.
double rms(const Image& a, const Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    const glm::dvec4 difference = a.pixels[i].color - b.pixels[i].color;
    sum += glm::dot(difference, difference);
  }
  return std::sqrt(sum / (4 * static_cast<double>(a.pixels.size())));
}

TEST(Quadrature, IsExactForPolynomials) {
  for (int degree = 0; degree < 2 * kGaussNodes; ++degree) {
    double sum = 0;
    for (const QuadratureNode& node : gaussRule()) sum += node.weight * std::pow(node.x, degree);
    EXPECT_NEAR(sum, 1.0 / (degree + 1), 1e-15) << degree;
  }
  for (int degree = 0; degree < kGaussNodes; ++degree) {
    for (std::size_t i = 0; i < kGaussNodes; ++i) {
      double sum = 0;
      for (std::size_t j = 0; j < kGaussNodes; ++j) sum += gaussPrimitive()[i][j] * std::pow(gaussRule()[j].x, degree);
      EXPECT_NEAR(sum, std::pow(gaussRule()[i].x, degree + 1) / (degree + 1), 1e-14) << degree;
    }
  }
}

TEST(AnalyticBlend, OneVoxelIsAHat) {
  DenseVolume volume = oneVoxel(VoxelType::rgba8, glm::ivec3(7), glm::ivec3(3), {255, 0, 128, 204});
  const auto depthAlong = [&](glm::dvec3 direction) {
    const View view = linearView(glm::dvec3(3.5) - 20.0 * direction, glm::dvec3(3.5));
    return -std::log1p(-converged(volume, view).a) / (0.3 * 0.8);
  };
  EXPECT_NEAR(depthAlong({0, 0, 1}), kHatAlongAxis, kTolerance);
  EXPECT_NEAR(depthAlong({1, 0, -1}), hatAlongFaceDiagonal(), kTolerance);
  EXPECT_NEAR(depthAlong({1, -1, 1}), hatAlongCubeDiagonal(), kTolerance);
  // Aside of the axis the hat is lower by the product of the two other distances.
  const View aside = linearView({3.75, 3.9, 20}, {3.75, 3.9, 3});
  EXPECT_NEAR(converged(volume, aside).a, -std::expm1(-0.3 * 0.8 * 0.75 * 0.6), kTolerance);
}

TEST(AnalyticBlend, RampWithALinearTransferIsExact) {
  const DenseVolume volume = ramp8();
  const glm::dvec3 eye(3.1, 4.2, 30);
  for (const glm::dvec3& target : {glm::dvec3(3.1, 4.2, 0), glm::dvec3(4.4, 3.3, 4)}) {
    View view = linearView(eye, target);
    view.channels[0].transfer = transferRamp(0, 0.1, 8, 0.9);
    const double stretch = glm::length(target - eye) / std::abs(target.z - eye.z);
    const auto opacityAt = [](double value) { return 0.1 + 0.1 * value; };
    const double interior = depthOfOpacityRamp(opacityAt(0.5), opacityAt(7.5), 7);
    const double ends = 0.5 * (depthOf(opacityAt(0.5)) + depthOf(opacityAt(7.5)));
    EXPECT_NEAR(converged(volume, view).a, -std::expm1(-stretch * (interior + ends)), kTolerance);
    view.clip = kInterior;
    const double clipped = stretch * depthOfOpacityRamp(opacityAt(1), opacityAt(7), 6);
    EXPECT_NEAR(converged(volume, view).a, -std::expm1(-clipped), kTolerance);
    // Within a range, and up to an opacity of 1, where the extinction is infinite but its integral is not.
    view.channels[0].range = DensityRange{.lo = 2.3, .hi = 4.7};
    const double ranged = stretch * depthOfOpacityRamp(opacityAt(2.3), opacityAt(4.7), 2.4);
    EXPECT_NEAR(converged(volume, view).a, -std::expm1(-ranged), kTolerance);
    view.channels[0].transfer = transferRamp(0, 0, 4.7, 1);
    const double steep = stretch * depthOfOpacityRamp(2.3 / 4.7, 1, 2.4);
    EXPECT_NEAR(converged(volume, view).a, -std::expm1(-steep), kTolerance);
    view.classification = Classification::pre_integrated;
    for (double step : {0.3, 1.0, 20.0}) {
      view.step = step;
      EXPECT_NEAR(lattice(volume, view).a, -std::expm1(-steep), kTolerance) << step;
    }
  }
}

// Constant extinction, colour straight from red at z = 1 to blue at z = 7, seen from the blue end.
TEST(AnalyticBlend, EmissionOfAColourRampIsExact) {
  const DenseVolume volume = ramp8();
  View view = linearView({3.1, 4.2, 30}, {3.1, 4.2, 0});
  view.channels[0].transfer = transferRamp(1, 0.4, 7, 0.4);
  view.clip = kInterior;
  const double sigma = depthOf(0.4), depth = 6 * sigma;
  // Integral of s / 6 sigma exp(-sigma s) over s = 0..6: red grows with the way.
  const double red = 1 / depth - std::exp(-depth) * (1 + 1 / depth);
  const double opacity = -std::expm1(-depth);
  EXPECT_NEAR(converged(volume, view).r * opacity, red, kTolerance);
  EXPECT_NEAR(converged(volume, view).b * opacity, opacity - red, kTolerance);
  EXPECT_NEAR(converged(volume, view).a, opacity, kTolerance);
}

TEST(AnalyticBlend, OpacityOfOneIsAnExtinctionOfAMillion) {
  const DenseVolume volume = ramp8();
  View view = linearView({3.1, 4.2, 30}, {3.1, 4.2, 0});
  view.channels[0].transfer = transferRamp(0, 1, 8, 1);
  view.clip = ClipBox{.min = {-100, -100, 3}, .max = {100, 100, 3 + 1e-6}};
  EXPECT_NEAR(converged(volume, view).a, -std::expm1(-1), 1e-8);
  EXPECT_NEAR(lattice(volume, view).a, -std::expm1(-1), 1e-8);
  view.classification = Classification::pre_integrated;
  EXPECT_NEAR(lattice(volume, view).a, -std::expm1(-1), 1e-8);
  view.filter = Filter::nearest;
  EXPECT_NEAR(lattice(volume, view).a, -std::expm1(-1), 1e-8);
  view.filter = Filter::linear;
  view.clip.reset();
  EXPECT_NEAR(converged(volume, view).a, 1, kTolerance);
  EXPECT_NEAR(glm::length(glm::dvec3(converged(volume, view)) - glm::dvec3(1 - 7.5 / 8, 0, 7.5 / 8)), 0, 1e-5);
}

// A transfer function far finer than a step: nothing at the samples, all of it between them.
TEST(AnalyticBlend, PreIntegrationSeesWhatIsBetweenTheSamples) {
  const DenseVolume volume = ramp8();
  for (const glm::dvec3& target : {glm::dvec3(3.1, 4.2, 4), glm::dvec3(4.4, 3.3, 4)}) {
    View view = linearView({3.1, 4.2, 30}, target);
    view.clip = kInterior;
    view.step = 1;
    const double stretch = glm::length(target - *view.eye) / (30 - 4);
    // A spike: 0.9 high at 3.75, gone at 3.7 and 3.85.
    view.channels[0].transfer = {{.value = 3.7, .color = {1, 0, 0}, .opacity = 0},
                                 {.value = 3.75, .color = {1, 0, 0}, .opacity = 0.9},
                                 {.value = 3.85, .color = {1, 0, 0}, .opacity = 0}};
    double depth = stretch * (depthOfOpacityRamp(0, 0.9, 0.05) + depthOfOpacityRamp(0.9, 0, 0.1));
    EXPECT_LT(std::abs(lattice(volume, view).a), 1e-9) << "post-classification";
    EXPECT_NEAR(converged(volume, view).a, -std::expm1(-depth), kTolerance);
    view.classification = Classification::pre_integrated;
    EXPECT_NEAR(lattice(volume, view).a, -std::expm1(-depth), kTolerance);
    EXPECT_NEAR(lattice(volume, view).r, 1, kTolerance);
    // Steps, one of them cut by the range; the colours are those of the two parts, weighted by their extinction.
    view.transfer_shape = TransferShape::stepped;
    view.channels[0].transfer = {{.value = 0, .color = {0, 0, 0}, .opacity = 0},
                                 {.value = 3.6, .color = {1, 0, 0}, .opacity = 0.5},
                                 {.value = 3.7, .color = {0, 0, 1}, .opacity = 0.8},
                                 {.value = 3.9, .color = {0, 1, 0}, .opacity = 0.99}};
    view.channels[0].range->hi = 3.85;
    const double red = stretch * 0.1 * depthOf(0.5), blue = stretch * 0.15 * depthOf(0.8);
    EXPECT_NEAR(lattice(volume, view).a, -std::expm1(-red - blue), kTolerance);
    EXPECT_NEAR(converged(volume, view).a, -std::expm1(-red - blue), kTolerance);
    EXPECT_EQ(lattice(volume, view).g, 0);
    if (target.x == 3.1) {
      EXPECT_NEAR(lattice(volume, view).r, red / (red + blue), kTolerance) << "all in [3, 4]";
    }
    EXPECT_NEAR(lattice(volume, view).r + lattice(volume, view).b, 1, kTolerance);
  }
}

// Red to blue over one interval: blue is the mean of u sigma over the mean of sigma, here by Simpson's rule.
TEST(AnalyticBlend, PreIntegratedColourIsWeightedByExtinction) {
  const DenseVolume volume = ramp8();
  for (const auto& [opacity0, opacity1] : {std::pair(0.2, 0.3), std::pair(0.2, 0.9), std::pair(0.95, 0.1)}) {
    View view = linearView({3.1, 4.2, 30}, {3.1, 4.2, 0});
    view.channels[0].transfer = transferRamp(4, opacity0, 6, opacity1);
    view.clip = ClipBox{.min = {-100, -100, 4}, .max = {100, 100, 6}};
    view.classification = Classification::pre_integrated;
    view.step = 20;
    constexpr int kParts = 4000;
    double mean = 0, first = 0;
    for (int i = 0; i <= kParts; ++i) {
      const double weight = i == 0 || i == kParts ? 1 : i % 2 == 1 ? 4 : 2;
      const double u = static_cast<double>(i) / kParts;
      const double sigma = weight * depthOf(opacity0 + u * (opacity1 - opacity0));
      mean += sigma;
      first += u * sigma;
    }
    EXPECT_NEAR(lattice(volume, view).b, first / mean, 1e-11) << opacity1;
    EXPECT_NEAR(lattice(volume, view).r, 1 - first / mean, 1e-11) << opacity1;
  }
}

TEST(AnalyticBlend, PreIntegrationOfAConstantIsClassification) {
  const DenseVolume volume = sampled(constantField(5), VoxelType::u8, glm::ivec3(4));
  View view = linearView({2, 2, 20}, {2, 2, 2});
  view.classification = Classification::pre_integrated;
  view.channels[0].transfer = transferRamp(0, 0.2, 10, 0.6);
  EXPECT_NEAR(lattice(volume, view).a, 1 - std::pow(0.6, 4), kTolerance);
  view.channels[0].range = DensityRange{.lo = 5, .hi = 5};
  EXPECT_NEAR(lattice(volume, view).a, 1 - std::pow(0.6, 4), kTolerance) << "both ends belong to the range";
  view.channels[0].range = DensityRange{.lo = 5.001, .hi = 6};
  EXPECT_EQ(lattice(volume, view).a, 0);
}

class MidpointOrder : public ::testing::Test {
 protected:
  MidpointOrder() : volume_(sampled(marschnerLobbField(16), VoxelType::f32, glm::ivec3(16))) {
    view_ = linearView({24, 31, 38}, glm::dvec3(8));
    view_.width = view_.height = 16;
    view_.fov_degrees = 24;
    view_.channels[0].transfer = transferRamp(0, 0.02, 1, 0.3);
  }
  // Errors for steps 1, 1/2, 1/4, ...
  std::vector<double> errors(int count) {
    const Image truth = renderImageConverged(volume_, view_);
    std::vector<double> result;
    for (int i = 0; i < count; ++i) {
      view_.step = std::ldexp(1.0, -i);
      result.push_back(rms(renderImage(volume_, view_), truth));
    }
    return result;
  }

  DenseVolume volume_;
  View view_;
};

TEST_F(MidpointOrder, IsTwoOnAContinuousField) {
  for (Classification classification : {Classification::post, Classification::pre_integrated}) {
    view_.classification = classification;
    const std::vector<double> error = errors(5);
    EXPECT_GT(error[0], 1e-6) << "the volume is too smooth to say anything";
    for (std::size_t i = 2; i < error.size(); ++i) {
      EXPECT_NEAR(std::log2(error[i - 1] / error[i]), 2, 0.25) << "step 2^-" << i;
    }
  }
}

TEST_F(MidpointOrder, IsCleanlyTwoOnASmoothOne) {
  // A ramp through a curved extinction, clipped to where both are smooth and to whole steps of the lattice.
  const DenseVolume volume = ramp8();
  View view = linearView({4, 4, 30}, {4, 4, 4});
  view.channels[0].transfer = transferRamp(0, 0.1, 8, 0.9);
  view.clip = ClipBox{.min = {-100, -100, 2}, .max = {100, 100, 6}};
  const double truth = -std::expm1(-depthOfOpacityRamp(0.3, 0.7, 4));
  double before = 0;
  for (double step : {1.0, 0.5, 0.25, 0.125}) {
    view.step = step;
    const double error = std::abs(lattice(volume, view).a - truth);
    if (before > 0) {
      EXPECT_NEAR(before / error, 4, 0.1) << step;
    }
    before = error;
  }
}

TEST_F(MidpointOrder, IsLowerWhereTheExtinctionJumps) {
  view_.channels[0].range = DensityRange{.lo = 0.45, .hi = 0.7};
  const std::vector<double> jump = errors(8);  // the first steps are too long to show the order
  EXPECT_NEAR(std::log2(jump[2] / jump[7]) / 5, 1, 0.25);
  // Pre-integration knows where between two samples the range ends.
  view_.classification = Classification::pre_integrated;
  const std::vector<double> integrated = errors(8);
  EXPECT_NEAR(std::log2(integrated[2] / integrated[7]) / 5, 2, 0.25);
  EXPECT_LT(integrated[7] * 50, jump[7]);
}

TEST_F(MidpointOrder, HoldsForLight) {
  view_.lit = true;
  const std::vector<double> error = errors(5);
  EXPECT_GT(std::log2(error[1] / error[4]) / 3, 1.5);
  EXPECT_LT(error[4], 1e-3);
}

// What the splitting finds, found by a lattice so fine that its error is below the tolerance.
TEST(AnalyticBlend, ConvergedIsTheLimitOfTheLattice) {
  DenseVolume volume = randomBytes({6, 5, 7}, 5);
  volume.density[volume.at({2, 2, 3})] = std::numeric_limits<float>::quiet_NaN();
  for (int i = 0; i < 6; ++i) {
    View view = linearView({12.0 - i, 9.0 + i, 15}, {3.1, 2.6 + 0.2 * i, 3.4});
    view.channels[0].transfer = {{.value = 20, .color = {1, 0.2, 0}, .opacity = 0},
                                 {.value = 90, .color = {0.3, 0.9, 0}, .opacity = 0.3},
                                 {.value = 130, .color = {0, 0.1, 1}, .opacity = 0.1},
                                 {.value = 200, .color = {1, 1, 0.5}, .opacity = 0.7}};
    view.lit = i % 2 == 1;
    view.step = 1.0 / 512;
    EXPECT_LT(glm::length(converged(volume, view) - lattice(volume, view)), 3e-6) << i;
  }
}

}  // namespace
}  // namespace blockwalk::reference
