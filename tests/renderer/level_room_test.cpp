// SPDX-License-Identifier: Apache-2.0
#include "renderer/level_room.h"

#include <gtest/gtest.h>

#include "renderer/plan/paging.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kBudget = 1000000;

// Three levels of 1000, 200 and 30 subblocks of u8.
VolumeInfo threeLevels() {
  VolumeInfo info;
  info.type = VoxelType::u8;
  info.subblock_side = 8;
  info.block_side = 6;
  info.channels.resize(1);
  info.levels.resize(3);
  std::uint64_t count = 1000;
  for (LevelInfo& level : info.levels) {
    level.block_count = count / 10;
    level.subblock_count = level.apron_subblock_count = count;
    count /= 5;
  }
  return info;
}

Plan planOf(int level, bool paged) {
  Plan plan;
  plan.level = level;
  plan.channels.resize(1);
  if (paged) {
    plan.coarse = {{.level = level + 1}};
    plan.stand_in = 0;
  }
  return plan;
}

ResolvedView viewOf(int level, Mode mode = Mode::blend) {
  ResolvedView view;
  view.level = level;
  view.mode = mode;
  view.drawn = {0};
  view.width = view.height = 64;
  view.camera.eye = {1, 1, 1};  // inside: the finest level is wanted
  return view;
}

const OutOfDeviceMemory kShort("short", 500, 400, "");
const OutOfDeviceMemory kFails("fails", 0, 0, "");

TEST(LevelRoom, WhatFindsNoRoomIsPagedAndThenCoarser) {
  const VolumeInfo info = threeLevels();
  LevelRoom room(kBudget);
  EXPECT_FALSE(room.hasGivenWay());
  EXPECT_TRUE(room.giveWay(7, info, viewOf(kAutoLevel), planOf(0, false), kShort));
  EXPECT_LT(room.pageAboveBytes(7), voxelBytes(info, planOf(0, false)));
  EXPECT_GE(room.pageAboveBytes(7), voxelBytes(info, planOf(1, false)));
  EXPECT_EQ(room.finestLevel(7), 0);
  EXPECT_FALSE(room.giveWay(7, info, viewOf(0), planOf(0, true), kShort)) << "who names the level is refused";
  EXPECT_TRUE(room.giveWay(7, info, viewOf(kAutoLevel), planOf(0, true), kShort));
  EXPECT_EQ(room.finestLevel(7), 1);
  EXPECT_EQ(room.finestLevel(8), 0);
  EXPECT_TRUE(room.giveWay(7, info, viewOf(kAutoLevel), planOf(1, true), kShort));
  EXPECT_EQ(room.finestLevel(7), 2);
  EXPECT_FALSE(room.giveWay(7, info, viewOf(kAutoLevel), planOf(2, false), kShort)) << "there is none that is coarser";
  EXPECT_EQ(room.pageAboveBytes(8), kBudget) << "another volume's views are not concerned";
  room.forget(7);
  EXPECT_EQ(room.finestLevel(7), 0);
}

// What the records of one window do not fit is no reason to draw all of the volume coarser.
TEST(LevelRoom, AWindowThatFindsNoRoomConcernsWindowsAsLargeAlone) {
  const VolumeInfo info = threeLevels();
  LevelRoom room(kBudget);
  Plan plan = planOf(0, true);
  plan.window = {.begin = glm::ivec3(0), .end = glm::ivec3(8)};
  plan.coarse.push_back({.level = 2, .window = {.begin = glm::ivec3(0), .end = glm::ivec3(24)}});
  EXPECT_TRUE(room.giveWay(7, info, viewOf(kAutoLevel), plan, kShort));
  EXPECT_EQ(room.finestLevel(7), 0);
  EXPECT_EQ(room.mostWindowCells(7), std::uint64_t{24 * 24 * 24}) << "the greatest is to blame, whose level it be";
  EXPECT_EQ(room.mostWindowCells(8), std::numeric_limits<std::uint64_t>::max());
  room.reconsider(kShort.needed_bytes);
  EXPECT_TRUE(room.hasGivenWay());
  room.reconsider(2 * kShort.needed_bytes);
  EXPECT_FALSE(room.hasGivenWay()) << "what was short is clearly there";
}

// Means are no maxima: without these a coarser level is no answer, and must not become everybody's.
TEST(LevelRoom, WhereNoCoarserLevelWillDoNothingChanges) {
  const VolumeInfo info = threeLevels();
  LevelRoom room(kBudget);
  EXPECT_FALSE(room.giveWay(7, info, viewOf(kAutoLevel, Mode::mip), planOf(0, true), kShort));
  EXPECT_EQ(room.finestLevel(7), 0);
}

TEST(LevelRoom, WhatFailsThoughThereIsRoomChangesNothing) {
  LevelRoom room(kBudget);
  EXPECT_FALSE(room.giveWay(7, threeLevels(), viewOf(kAutoLevel), planOf(0, false), kFails));
  EXPECT_FALSE(room.hasGivenWay());
  LevelRoom never(0);
  EXPECT_FALSE(never.giveWay(7, threeLevels(), viewOf(kAutoLevel), planOf(0, false), kShort));
}

TEST(LevelRoom, WhereThereIsClearlyRoomAgainAllIsAsBefore) {
  const VolumeInfo info = threeLevels();
  const std::uint64_t bytes = voxelBytes(info, planOf(0, false));
  LevelRoom room(kBudget);
  ASSERT_TRUE(room.giveWay(7, info, viewOf(kAutoLevel), planOf(0, false), kShort));
  ASSERT_TRUE(room.giveWay(7, info, viewOf(kAutoLevel), planOf(0, true), kShort));
  room.reconsider(bytes);
  EXPECT_EQ(room.finestLevel(7), 1);
  EXPECT_LT(room.pageAboveBytes(7), bytes);
  room.reconsider(bytes * 5 / 4 + 5);
  EXPECT_EQ(room.finestLevel(7), 0);
  EXPECT_EQ(room.pageAboveBytes(7), kBudget);
  EXPECT_FALSE(room.hasGivenWay());
}

}  // namespace
}  // namespace blockwalk
