// SPDX-License-Identifier: Apache-2.0
// The reference's light against the formula of docs/integration.md written out for views along z.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/renderer/closed_forms.h"

namespace blockwalk::reference {
namespace {

constexpr glm::dvec3 kColor{0.5, 0.1, 0.7};

// Looks along -z with +x to the right and +y up.
View litAlongZ(double x, double y, Mode mode) {
  View view = linearView({x, y, 30}, {x, y, 0}, mode);
  view.up = glm::dvec3(0, 1, 0);
  view.channels[0].transfer = {{.value = 0, .color = kColor, .opacity = 0.9}};
  view.iso = 1;
  view.lit = true;
  return view;
}

// kColor seen along -z, the light from (-1, 1, 1).
glm::dvec3 litColor(glm::dvec3 gradient) {
  const glm::dvec3 n = gradient / std::sqrt(glm::dot(gradient, gradient));
  const double towards_light = std::abs(-n.x + n.y + n.z) / std::numbers::sqrt3;
  const double factor = 0.3 + 0.4 * std::abs(n.z) + 0.3 * towards_light;
  return factor * kColor + 0.2 * std::pow(n.z * n.z, 16);
}

TEST(AnalyticLight, ComesOverTheLeftShoulder) {
  for (const glm::dvec3& slope : {glm::dvec3(0.25, 0, 1), glm::dvec3(-0.25, 0, 1), glm::dvec3(0, 0.25, 1),
                                  glm::dvec3(0, -0.25, 1), glm::dvec3(-0.5, 0.25, -1), glm::dvec3(1, 0.125, 0.25)}) {
    const DenseVolume volume = sampled(rampField(20, slope), VoxelType::f32, glm::ivec3(8));
    for (Mode mode : {Mode::first_hit, Mode::iso, Mode::blend}) {
      View view = litAlongZ(4.2, 3.7, mode);
      view.clip = ClipBox{.min = {-100, -100, 2}, .max = {100, 100, 5.75}};
      for (Filter filter : {Filter::linear, Filter::nearest}) {
        view.filter = filter;
        EXPECT_LT(distance(colorOf(volume, view), litColor(slope)), 1e-9) << slope.x << ' ' << slope.y;
      }
    }
  }
}

TEST(AnalyticLight, TakesTheNearestFiltersGradientFromTheNextVoxels) {
  DenseVolume volume = emptyVolume(VoxelType::u8, glm::ivec3(5));
  std::mt19937 random(9);
  for (float& density : volume.density) density = static_cast<float>(1 + random() % 255);
  View view = litAlongZ(2.3, 1.6, Mode::first_hit);
  view.filter = Filter::nearest;
  for (int z = 4; z >= 0; --z) {
    view.clip = ClipBox{.min = glm::dvec3(-100), .max = {100, 100, z + 0.6}};
    const auto densityAt = [&](int x, int y, int k) {
      return static_cast<double>(volume.density[volume.at({x, y, std::clamp(k, 0, 4)})]);
    };
    const glm::dvec3 gradient(densityAt(3, 1, z) - densityAt(1, 1, z), densityAt(2, 2, z) - densityAt(2, 0, z),
                              densityAt(2, 1, z + 1) - densityAt(2, 1, z - 1));
    EXPECT_LT(distance(colorOf(volume, view), litColor(gradient)), kTolerance) << z;
  }
}

TEST(AnalyticLight, ShadesARampByItsNormal) {
  const DenseVolume volume = ramp8();
  for (Filter filter : {Filter::linear, Filter::nearest}) {
    for (Mode mode : {Mode::first_hit, Mode::iso, Mode::blend}) {
      View view = linearView({4, 4, 30}, {4, 4, 0}, mode);
      view.filter = filter;
      view.channels[0].transfer = {{.value = 0, .color = {0.5, 0.1, 0.9}, .opacity = 0.9999}};
      view.channels[0].range = DensityRange{.lo = 3.2, .hi = 100};
      view.iso = 3.2;
      view.clip = ClipBox{.min = {-100, -100, 2}, .max = {100, 100, 5}};
      view.lit = true;
      view.up = glm::dvec3(0, 1, 0);
      const double factor = 0.3 + 0.4 + 0.3 / std::numbers::sqrt3;
      const glm::dvec3 expected = glm::min(factor * glm::dvec3(0.5, 0.1, 0.9) + 0.2, glm::dvec3(1));
      EXPECT_LT(distance(colorOf(volume, view), expected), 1e-9) << static_cast<int>(mode);
    }
  }
  // mip and mean are not lit; a constant has no normal.
  View view = linearView({4, 4, 30}, {4, 4, 0}, Mode::mip);
  view.channels[0].transfer = {{.value = 0, .color = {0.5, 0.1, 0.9}, .opacity = 1}};
  view.lit = true;
  EXPECT_LT(distance(colorOf(volume, view), {0.5, 0.1, 0.9}), kTolerance);
  view.mode = Mode::mean;
  EXPECT_LT(distance(colorOf(volume, view), {0.5, 0.1, 0.9}), kTolerance);
  view.mode = Mode::first_hit;
  const DenseVolume flat = sampled(constantField(77), VoxelType::u8, glm::ivec3(8));
  EXPECT_LT(distance(colorOf(flat, view), {0.5, 0.1, 0.9}), kTolerance);
}

}  // namespace
}  // namespace blockwalk::reference
