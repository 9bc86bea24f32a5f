// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/level_choice.h"

#include <gtest/gtest.h>

#include "tests/renderer/plan/plans.h"

namespace blockwalk {
namespace {

TEST(LevelChoice, LevelFollowsThePixel) {
  const VolumeInfo info = volumeOf(VoxelType::rgba8, 5, 250);
  View view;
  view.ortho_height = 512;
  view.width = view.height = 512;
  EXPECT_EQ(planFor(view, info).level, 0);
  view.width = view.height = 256;
  EXPECT_EQ(planFor(view, info).level, 1);
  view.width = view.height = 129;  // 3.97 voxels a pixel: level 1 is still finer than a pixel, level 2 is not
  EXPECT_EQ(planFor(view, info).level, 1);
  view.width = view.height = 1;
  EXPECT_EQ(planFor(view, info).level, static_cast<int>(info.levels.size()) - 1);
  view.level = 0;
  EXPECT_EQ(planFor(view, info).level, 0);
  view.level = 99;
  EXPECT_THROW(planFor(view, info), ViewError);
}

TEST(LevelChoice, AMaximumIsDrawnFromMaxima) {
  VolumeInfo info = volumeOf(VoxelType::u8, 5, 250);
  ASSERT_GT(info.levels.size(), 4u);
  View view;
  view.ortho_height = 512;
  view.mode = Mode::mip;
  const auto planOfWidth = [&](int width) {
    view.width = view.height = width;
    return planFor(view, info);
  };
  // Without them it is drawn from what no mean has touched.
  EXPECT_EQ(planOfWidth(129).level, 0);
  EXPECT_EQ(planOfWidth(129).form, Form::values);
  info.maxima.assign(info.levels.begin() + kFirstMaximaLevel, info.levels.end());
  EXPECT_EQ(planOfWidth(257).level, 0);  // less than two voxels a pixel
  EXPECT_EQ(planOfWidth(257).form, Form::values);
  EXPECT_EQ(planOfWidth(129).level, 2);  // whose voxels are no smaller than a pixel
  EXPECT_EQ(planOfWidth(129).form, Form::maxima);
  EXPECT_EQ(planOfWidth(128).level, 2);
  EXPECT_EQ(planOfWidth(127).level, 3);
  EXPECT_EQ(planOfWidth(1).level, static_cast<int>(info.levels.size()) - 1);
  view.level = 1;  // which has means alone
  EXPECT_EQ(planOfWidth(127).level, 0);
  info.channels[0].values = ChannelValues::labels;  // which have no means
  EXPECT_EQ(planOfWidth(127).level, 1);
  info.channels[0].values = ChannelValues::intensity;
  view.level = 3;
  EXPECT_EQ(planOfWidth(127).form, Form::maxima);
  view.mode = Mode::blend;
  EXPECT_EQ(planOfWidth(127).form, Form::values);
}

TEST(LevelChoice, InsideTheVolumeIsLevelZero) {
  const VolumeInfo info = volumeOf(VoxelType::rgba8, 5, 250);
  View view;
  view.width = view.height = 16;
  view.eye = glm::dvec3(256, 256, 256);
  view.target = glm::dvec3(0, 256, 256);
  EXPECT_EQ(planFor(view, info).level, 0);
}

}  // namespace
}  // namespace blockwalk
