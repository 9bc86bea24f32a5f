// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/clip_planes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/renderer/plan/plans.h"

namespace blockwalk {
namespace {

TEST(ClipPlanes, ThatCutNothingAreLeftOut) {
  const VolumeInfo info = volumeOf(VoxelType::rgba8, 5, 250);  // 0..512 along each axis
  View view;
  view.clip = ClipBox{.min = {-1, 0, -3}, .max = {512, 513, 600}};
  view.planes = {{{1, 1, 1}, 0}, {{-1, 0, 0}, 512.5}};
  EXPECT_EQ(planFor(view, info).key.clip, 0u);
  EXPECT_TRUE(planFor(view, info).planes.empty());
  view.clip->max.y = 500;
  view.planes.push_back({{0, 0, 4}, -40});
  const Plan cut = planFor(view, info);
  EXPECT_EQ(cut.key.clip, 1u);
  const std::vector<ClipPlane> expected = {{{0, -1, 0}, 500}, {{0, 0, 1}, -10}};
  EXPECT_EQ(cut.planes, expected);
}

TEST(ClipPlanes, WithoutDirectionAreRefused) {
  const VolumeInfo info = volumeOf(VoxelType::rgba8, 5, 250);
  const auto fieldOf = [&](const std::vector<ClipPlane>& planes) {
    View view;
    view.planes = planes;
    try {
      planFor(view, info);
    } catch (const ViewError& error) {
      return error.field;
    }
    return std::string();
  };
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(fieldOf({{{0, 0, -1e-320}, 0}}), "");
  EXPECT_EQ(fieldOf({{{0, 0, 0}, 1}}), "planes");
  EXPECT_EQ(fieldOf({{{1, 0, 0}, kInfinity}}), "planes");
  EXPECT_EQ(fieldOf({{{1, std::nan(""), 0}, 0}}), "planes");
  EXPECT_EQ(fieldOf(std::vector<ClipPlane>(7, {{1, 0, 0}, 0})), "planes");
}

}  // namespace
}  // namespace blockwalk
