// SPDX-License-Identifier: Apache-2.0
// The reference's linear filter against closed forms.
#include "tests/reference/analytic.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/reference/cut_ray.h"
#include "tests/reference/dense_source.h"
#include "tests/reference/field.h"
#include "tests/renderer/closed_forms.h"

namespace blockwalk::reference {
namespace {

double opacityOf(const DenseVolume& volume, const View& view) { return renderPixel(volume, view, 0, 0).color.a; }

glm::dvec3 randomPoint(std::mt19937& random, glm::dvec3 lo, glm::dvec3 hi) {
  std::uniform_real_distribution<double> value(0, 1);
  const double x = value(random), y = value(random), z = value(random);
  return lo + (hi - lo) * glm::dvec3(x, y, z);
}

TEST(Analytic, FieldReproducesLinearFunctionsAndTheirGradient) {
  const Analytic ramp = rampField(3, {0.5, -0.25, 1.75});
  const DenseVolume volume = sampled(ramp, VoxelType::f32, {9, 8, 7});
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    const glm::dvec3 p = randomPoint(random, glm::dvec3(1), glm::dvec3(8, 7, 6));
    EXPECT_NEAR(fieldAt(volume, p).w, ramp.value(p), kTolerance);
    EXPECT_LT(glm::length(gradientAt(volume, p, 0.5) - ramp.gradient(p)), kTolerance);
  }
  // Clamped to the edge: at and beyond half a voxel from the faces nothing changes any more.
  EXPECT_EQ(fieldAt(volume, {-3, 4.5, 3.5}), fieldAt(volume, {0.5, 4.5, 3.5}));
  EXPECT_EQ(fieldAt(volume, {0.2, 9.9, 3.5}), fieldAt(volume, {0.5, 7.5, 3.5}));
  EXPECT_EQ(fieldAt(volume, {1e30, 4.5, 3.5}), fieldAt(volume, {8.5, 4.5, 3.5}));
  EXPECT_NEAR(gradientAt(volume, {0, 4.5, 3.5}, 0.5).x, 0, kTolerance);
  EXPECT_NEAR(gradientAt(volume, {0.5, 4.5, 3.5}, 0.5).x, 0.25, kTolerance);
}

TEST(Analytic, CheckerboardIsTrilinearBetweenItsVoxels) {
  const Analytic board = checkerboardField();
  const DenseVolume volume = sampled(board, VoxelType::u8, {8, 8, 8});
  EXPECT_EQ(volume.density[volume.at({0, 0, 0})], 255);
  EXPECT_EQ(volume.density[volume.at({0, 1, 0})], 0);
  std::mt19937 random(2);
  for (int i = 0; i < 200; ++i) {
    const glm::dvec3 p = randomPoint(random, glm::dvec3(0.5), glm::dvec3(7.5));
    EXPECT_NEAR(fieldAt(volume, p).w, board.value(p), 1e-10);
  }
}

TEST(Analytic, CubicAlongARayIsTheField) {
  const DenseVolume volume = sampled(checkerboardField(), VoxelType::u8, {4, 4, 4});
  const Ray ray{.origin = {0.6, 0.7, 0.9}, .direction = {0.2, 0.3, -0.1}};
  const Cell cell = cellAround(volume, ray.at(1));
  const Cubic cubic = cubicAlong(cell, ray, 1);
  for (double t : {0.2, 1.0, 1.9, 2.5}) {
    EXPECT_NEAR(cubic.at(t).w, fieldAt(volume, ray.at(t)).w, 1e-11) << t;
    const double difference = (fieldAt(volume, ray.at(t + 1e-5)).w - fieldAt(volume, ray.at(t - 1e-5)).w) / 2e-5;
    EXPECT_NEAR(cubic.slopeAt(t), difference, 1e-5) << t;
  }
}

TEST(Analytic, GradientsAreTheDerivativesOfTheirFields) {
  std::mt19937 random(3);
  for (const Analytic& field : {rampField(1, {2, 3, 4}), shellsField({5, 6, 7}, 3, 100), marschnerLobbField(16),
                                checkerboardField(), constantField(7)}) {
    for (int i = 0; i < 50; ++i) {
      const glm::dvec3 p = randomPoint(random, glm::dvec3(1), glm::dvec3(15));
      for (int a = 0; a < 3; ++a) {
        glm::dvec3 step(0);
        step[a] = 1e-6;
        EXPECT_NEAR(field.gradient(p)[a], (field.value(p + step) - field.value(p - step)) / 2e-6, 1e-5);
      }
    }
  }
}

TEST(Analytic, SourceYieldsTheVolume) {
  DenseVolume scalars = sampled(shellsField({3, 4, 5}, 3, 900), VoxelType::u16, {6, 7, 8});
  DenseVolume bytes = sampled(checkerboardField(), VoxelType::u8, {6, 7, 8});
  DenseVolume floats = sampled(marschnerLobbField(8), VoxelType::f32, {6, 7, 8});
  DenseVolume colors = oneVoxel(VoxelType::rgba8, {6, 7, 8}, {2, 3, 4}, {1, 20, 200, 99});
  std::ranges::replace_if(
      colors.density, [](float density) { return !std::isfinite(density); }, 0.0f);
  for (DenseVolume* volume : {&scalars, &bytes, &floats, &colors}) {
    volume->value_scale = 0.5;
    volume->world_from_index[3] = {1, 2, 3, 1};
    const std::unique_ptr<Source> source = makeDenseSource(*volume);
    const DenseVolume read = volumeFromSource(*source, volume->empty_threshold, volume->block_voxels);
    EXPECT_EQ(read.density, volume->density);
    EXPECT_EQ(read.color, volume->color);
    EXPECT_EQ(read.world_from_index, volume->world_from_index);
    EXPECT_EQ(read.value_scale, 0.5);
    EXPECT_EQ(read.blocks, volume->blocks);
  }
}

TEST(Analytic, ConstantSlabHasTheOpacityOfItsLength) {
  DenseVolume volume = sampled(constantField(80), VoxelType::u8, {7, 9, 11});
  volume.type = VoxelType::rgba8;
  volume.color.assign(volume.density.size(), {255, 128, 0});
  for (double step : {0.1, 0.5, 1.0, 3.7}) {
    View view = linearView({3.3, 4.4, 30}, {3.3, 4.4, 0});
    view.step = step;
    const Pixel pixel = renderPixel(volume, view, 0, 0);
    EXPECT_NEAR(pixel.color.a, -std::expm1(-0.3 * 80 / 255 * 11), kTolerance) << step;
    EXPECT_NEAR(pixel.color.g, 128 / 255.0, kTolerance) << step;
    view = linearView({3.3, 4.4, 30}, {2.3, 5.4, 5.5});
    view.step = step;
    const double cosine = 24.5 / glm::length(*view.eye - *view.target);
    EXPECT_NEAR(opacityOf(volume, view), -std::expm1(-0.3 * 80 / 255 * 11 / cosine), kTolerance) << step;
    view.clip = ClipBox{.min = {-100, -100, 2.25}, .max = {100, 100, 7}};
    EXPECT_NEAR(opacityOf(volume, view), -std::expm1(-0.3 * 80 / 255 * 4.75 / cosine), kTolerance) << step;
  }
}

TEST(Analytic, LatticeStartsAtTheCentrePlaneOrTheEye) {
  const DenseVolume volume = sampled(constantField(80), VoxelType::u8, {8, 8, 8});
  const glm::dvec3 centre(4);
  const auto lattice = [&](const View& view) { return latticeOf(volume, view, cutRay(volume, view, 0, 0)); };
  View view = linearView({4, 4, 24}, centre);
  view.width = 3;  // pixel 0 looks off the axis
  view.height = 1;
  const Ray ray = worldRay(view, 0, 0);
  EXPECT_NEAR(ray.at(lattice(view).t_zero).z, 4, kTolerance);
  EXPECT_NEAR(lattice(view).dt, 0.5, kTolerance);
  view.eye = glm::dvec3(4, 4, 10);  // 6 before the centre, the radius is 6.93
  EXPECT_EQ(lattice(view).t_zero, 0);
  view.ortho_height = 3;
  EXPECT_NEAR(lattice(view).t_zero, 6, kTolerance);
  view = linearView({4, 4, 24}, {4, 4, 40});  // looks away
  EXPECT_EQ(lattice(view).t_zero, 0);
}

TEST(Analytic, FirstHitOnARampIsTheCrossing) {
  const Analytic ramp = rampField(-10, {0.5, 2, 1});
  const DenseVolume volume = sampled(ramp, VoxelType::f32, glm::ivec3(16));
  std::mt19937 random(4);
  for (int i = 0; i < 100; ++i) {
    View view = linearView(randomPoint(random, {-20, -30, -20}, {20, -20, 20}),
                           randomPoint(random, {6, 6, 6}, {10, 10, 10}), Mode::first_hit);
    view.step = 0.25 + i % 7 * 0.3;
    view.channels[0].transfer = transferRamp(-100, 0.5, 100, 0.5);
    const double crossing = ramp.value(*view.target);
    view.channels[0].range->lo = crossing;
    const Pixel pixel = renderPixel(volume, view, 0, 0);
    EXPECT_NEAR(pixel.t, glm::length(*view.target - *view.eye), 1e-9) << i;
    EXPECT_NEAR(pixel.value, crossing, 1e-9);
    EXPECT_NEAR(pixel.slope, glm::dot(ramp.gradient({}), glm::normalize(*view.target - *view.eye)), 1e-9);
    EXPECT_EQ(pixel.voxel, glm::ivec3(glm::floor(*view.target)));
    EXPECT_FALSE(pixel.at_entry);
    view.mode = Mode::iso;
    view.channels[0].range = DensityRange{.lo = 1e9, .hi = 1e10};
    view.channels[0].transfer = transferRamp(-100, 0, 100, 0);
    view.iso = crossing;
    EXPECT_NEAR(renderPixel(volume, view, 0, 0).t, pixel.t, 1e-9) << i;
  }
}

}  // namespace
}  // namespace blockwalk::reference
