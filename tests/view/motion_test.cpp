// SPDX-License-Identifier: Apache-2.0
#include "view/motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "view/resolved_view.h"

namespace blockwalk {
namespace {

VolumeInfo cube() {
  VolumeInfo info;
  info.type = VoxelType::u8;
  info.dims = glm::ivec3(100);
  info.channels.resize(1);
  info.channels[0].density_min = 5;
  info.channels[0].density_max = 250;
  info.levels.push_back({.dims = info.dims, .block_count = 1, .subblock_count = 1, .voxel_bytes = 512});
  return info;
}

ResolvedView at(glm::dvec3 eye, glm::dvec3 target) {
  View view;
  view.eye = eye;
  view.target = target;
  return resolveView(view, cube());
}

glm::dvec3 onOrbit(double angle) { return glm::dvec3(50) + 200.0 * glm::dvec3(std::sin(angle), 0.3, std::cos(angle)); }

void expectSameCamera(const ResolvedView& a, const ResolvedView& b) {
  EXPECT_LT(glm::length(a.camera.eye - b.camera.eye), 1e-9);
  EXPECT_LT(glm::length(a.camera.right - b.camera.right), 1e-12);
  EXPECT_LT(glm::length(a.camera.up - b.camera.up), 1e-12);
  EXPECT_LT(glm::length(a.camera.forward - b.camera.forward), 1e-12);
  EXPECT_LT(glm::length(a.target - b.target), 1e-9);
  EXPECT_NEAR(a.camera.half_height, b.camera.half_height, 1e-9);
  EXPECT_NEAR(a.camera.half_width, b.camera.half_width, 1e-9);
}

TEST(Motion, AnOrbitGoesOnAsAnOrbit) {
  const glm::dvec3 centre(50);
  for (const int times : {1, 2, 8}) {
    const auto next = movedOn(at(onOrbit(0.1), centre), at(onOrbit(0.13), centre), times);
    ASSERT_TRUE(next);
    expectSameCamera(*next, at(onOrbit(0.13 + 0.03 * times), centre));
  }
}

TEST(Motion, AShiftGoesOnStraight) {
  const glm::dvec3 step(3, -1, 2);
  const auto next =
      movedOn(at({50, 50, 300}, glm::dvec3(50)), at(glm::dvec3(50, 50, 300) + step, glm::dvec3(50) + step), 4);
  ASSERT_TRUE(next);
  expectSameCamera(*next, at(glm::dvec3(50, 50, 300) + 5.0 * step, glm::dvec3(50) + 5.0 * step));
}

TEST(Motion, TheWidthOfAPictureGoesOnByItsFactor) {
  View view;
  view.ortho_height = 100;
  const ResolvedView before = resolveView(view, cube());
  view.ortho_height = 80;
  const ResolvedView now = resolveView(view, cube());
  view.ortho_height = 64;
  const auto next = movedOn(before, now, 1);
  ASSERT_TRUE(next);
  EXPECT_NEAR(next->camera.half_height, resolveView(view, cube()).camera.half_height, 1e-12);
}

TEST(Motion, WhatStandsStillOrIsAnotherViewDoesNotGoOn) {
  const ResolvedView before = at(onOrbit(0.1), glm::dvec3(50));
  const ResolvedView now = at(onOrbit(0.2), glm::dvec3(50));
  EXPECT_FALSE(movedOn(now, now, 1));
  View small;
  small.width = small.height = 100;
  small.eye = onOrbit(0.2);
  small.target = glm::dvec3(50);
  EXPECT_FALSE(movedOn(resolveView(small, cube()), now, 1)) << "of another size it has not moved";
  small.eye = onOrbit(0.1);
  EXPECT_TRUE(movedOn(resolveView(small, cube()), now, 1));
  ResolvedView other = before;
  other.mode = Mode::mip;
  EXPECT_FALSE(movedOn(other, now, 1));
  other = before;
  other.channels[0].range.hi = 7;
  EXPECT_FALSE(movedOn(other, now, 1));
  other = before;
  other.camera.orthographic = true;
  EXPECT_FALSE(movedOn(other, now, 1));
}

TEST(Motion, WhatWouldOverflowDoesNotGoOn) {
  ResolvedView before = at(onOrbit(0.1), glm::dvec3(50));
  ResolvedView now = before;
  now.camera.half_height *= 1e200;
  EXPECT_FALSE(movedOn(before, now, 2));
}

}  // namespace
}  // namespace blockwalk
