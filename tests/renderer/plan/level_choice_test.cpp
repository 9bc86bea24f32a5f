// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/level_choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

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

// From its end a volume 512 deep; at a depth of 1 a pixel covers 1/32 of a voxel.
View deepView() {
  View view;
  view.width = view.height = 64;
  view.fov_degrees = 90;
  view.eye = glm::dvec3(256, 256, 520);
  view.target = glm::dvec3(256, 256, 0);
  return view;
}

std::vector<int> farLevelsOf(const Plan& plan) {
  std::vector<int> levels;
  for (const CoarsePlan& far : plan.coarse) levels.push_back(far.level);
  return levels;
}

TEST(LevelChoice, FartherPartsAreDrawnOfCoarserLevels) {
  VolumeInfo info = volumeOf(VoxelType::u8, 5, 250);
  View view = deepView();
  view.lod = 1;
  Plan plan = planFor(view, info);
  EXPECT_EQ(plan.level, 0);
  EXPECT_EQ(farLevelsOf(plan), (std::vector{1, 2, 3}));  // 16.25 voxels a pixel at the far end; a kernel takes three
  EXPECT_EQ(plan.farLevel(), 3);
  EXPECT_NEAR(plan.coarse[0].depth, 64, 1e-9);
  EXPECT_NEAR(plan.coarse[1].depth, 128, 1e-9);
  EXPECT_TRUE(plan.isMixed());
  view.lod = 2;
  plan = planFor(view, info);
  EXPECT_EQ(farLevelsOf(plan), (std::vector{1, 2, 3}));
  EXPECT_NEAR(plan.coarse[0].depth, 128, 1e-9);
  view.lod = 5;
  EXPECT_EQ(farLevelsOf(planFor(view, info)), (std::vector{1}));
  info.levels[2].block_count = 0;
  view.lod = 1;
  EXPECT_EQ(farLevelsOf(planFor(view, info)), (std::vector{1})) << "of level 2 nothing is stored";
}

TEST(LevelChoice, OneLevelServesWhatHasOneOrNamesOne) {
  const VolumeInfo info = volumeOf(VoxelType::u8, 5, 250);
  const auto count = [&](auto change) {
    View view = deepView();
    change(view);
    const Plan plan = planFor(view, info);
    EXPECT_EQ(plan.isMixed(), !plan.coarse.empty());
    EXPECT_EQ(plan.farLevel() > plan.level, !plan.coarse.empty());
    return plan.coarse.size();
  };
  EXPECT_EQ(count([](View&) {}), 3u);
  EXPECT_EQ(count([](View& view) { view.lod = kOneLevel; }), 0u);
  EXPECT_EQ(count([](View& view) { view.level = 0; }), 0u);
  EXPECT_EQ(count([](View& view) { view.ortho_height = 512; }), 0u);
  EXPECT_EQ(count([](View& view) { view.mode = Mode::blocks; }), 0u);
  EXPECT_EQ(count([](View& view) { view.mode = Mode::mip; }), 0u) << "without maxima";
}

// Coarser levels hold means and greatest densities: neither says what is least, nor what lies before something.
TEST(LevelChoice, AMinimumAndWhatIsAttenuatedAreOfLevelZero) {
  VolumeInfo info = volumeOf(VoxelType::u8, 5, 250);
  info.maxima.assign(info.levels.begin() + kFirstMaximaLevel, info.levels.end());
  for (const Mode mode : {Mode::minip, Mode::attenuated_mip}) {
    info.channels[0].values = ChannelValues::intensity;
    View view = deepView();
    view.mode = mode;
    EXPECT_FALSE(planFor(view, info).isMixed());
    EXPECT_EQ(planFor(view, info, {.finest_level = 2}).level, 0) << "whatever room there is";
    view.ortho_height = 4096;
    for (const int level : {kAutoLevel, 0, 1, 2, 3}) {
      view.level = level;
      EXPECT_EQ(planFor(view, info).level, 0);
      EXPECT_EQ(planFor(view, info).form, Form::values);
    }
    info.channels[0].values = ChannelValues::labels;  // which have no means
    EXPECT_EQ(planFor(view, info).level, 3);
  }
}

TEST(LevelChoice, WhereTheFirstLevelsFindNoRoomFartherPartsAreCoarserStill) {
  const VolumeInfo info = volumeOf(VoxelType::u8, 5, 250);
  View view = deepView();
  view.lod = 1;
  const Plan plan = planFor(view, info, {.finest_level = 2});
  EXPECT_EQ(plan.level, 2);
  EXPECT_EQ(farLevelsOf(plan), (std::vector{3, 4}));
  EXPECT_NEAR(plan.coarse[0].depth, 256, 1e-9);
}

// Of five levels the one after the finest is a quarter of lambda.
TEST(LevelChoice, BehindAnOpacityLevelsAreCoarser) {
  const VolumeInfo info = volumeOf(VoxelType::u8, 5, 250);
  View view = deepView();
  view.lod = kMaxLod;
  EXPECT_FALSE(planFor(view, info).isMixed());
  view.lod_alpha = 0.5;
  const Plan plan = planFor(view, info);
  EXPECT_EQ(farLevelsOf(plan), (std::vector{1}));
  EXPECT_NEAR(plan.coarse[0].transmittance, 0.5, 1e-12);
  view.lod_alpha = 1;
  EXPECT_EQ(farLevelsOf(planFor(view, info)), (std::vector{1, 2, 3}));
  EXPECT_NEAR(planFor(view, info).coarse[2].transmittance, 0.25, 1e-12);
  view.ortho_height = 32;
  EXPECT_EQ(farLevelsOf(planFor(view, info)), (std::vector{1, 2, 3}));
  view.mode = Mode::mean;
  EXPECT_FALSE(planFor(view, info).isMixed());
}

// The voxels of all of them are counted, and those finer than what stands in come and go.
TEST(LevelChoice, OfSeveralLevelsEachMayBePaged) {
  const VolumeInfo info = volumeOf(VoxelType::u8, 5, 250);
  View view = deepView();
  view.lod = 1;
  const std::uint64_t a_level = 64 * 512;
  EXPECT_FALSE(planFor(view, info, {.page_above_bytes = 4 * a_level, .page_room_bytes = 4 * a_level}).isPaged());
  const Plan plan = planFor(view, info, {.page_above_bytes = 4 * a_level - 1, .page_room_bytes = 8 * a_level});
  EXPECT_TRUE(plan.isPaged());
  EXPECT_EQ(plan.stand_in, 0u) << "the finest coarser one takes a quarter of the room";
  for (const CoarsePlan& far : plan.coarse) EXPECT_FALSE(far.paged);
  const Plan tight = planFor(view, info, {.page_above_bytes = a_level, .page_room_bytes = a_level});
  EXPECT_EQ(tight.stand_in, tight.coarse.size() - 1) << "the coarsest of all stands in where none takes so little";
  EXPECT_EQ(tight.farCount(), 3u);
  EXPECT_EQ(std::ranges::count(tight.coarse, true, &CoarsePlan::paged), 3);
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
