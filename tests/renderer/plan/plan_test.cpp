// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/plan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "shaders/kernel_interface.h"
#include "tests/renderer/plan/plans.h"

namespace blockwalk {
namespace {

TEST(Plan, OpenRangeNeedsNoTestsAndNoCulling) {
  const Plan open = planFor({}, volumeOf(VoxelType::rgba8, 5, 250));
  EXPECT_EQ(open.key.range_open, 1u);
  EXPECT_EQ(open.key.cull, 0u);
  EXPECT_EQ(open.key.test_voxel, 0u);
  EXPECT_FALSE(open.asksFor(Part::table));
}

TEST(Plan, AnOpenRangeCullsWhereManyStoredVoxelsAreEmpty) {
  VolumeInfo info = volumeOf(VoxelType::rgba8, 5, 250);
  info.channels[0].nonempty_voxels = 8 * 512;  // of 64 subblocks
  const Plan hollow = planFor({}, info);
  EXPECT_EQ(hollow.key.range_open, 1u);
  EXPECT_EQ(hollow.key.cull, 1u);
  EXPECT_TRUE(hollow.asksFor(Part::visible_quarters));
  info.channels[0].nonempty_voxels = 32 * 512;  // half: worth looking for before a linear sample, not before a voxel
  View view;
  EXPECT_EQ(planFor(view, info).key.cull, 0u);
  view.mode = Mode::mip;
  EXPECT_EQ(planFor(view, info).key.cull, 1u);
  view.mode = Mode::blend;
  view.filter = Filter::linear;
  EXPECT_EQ(planFor(view, info).key.cull, 1u);
  View blocks;
  blocks.mode = Mode::blocks;
  EXPECT_EQ(planFor(blocks, info).key.cull, 0u);
  EXPECT_FALSE(planFor(blocks, info).asksFor(Part::visible_quarters));
}

TEST(Plan, NarrowRangeTestsVoxelsOfRgba8ButNotOfU8) {
  View view;
  view.channels[0].range = DensityRange{100, 200};
  const Plan colour = planFor(view, volumeOf(VoxelType::rgba8, 5, 250));
  EXPECT_EQ(colour.key.cull, 1u);
  EXPECT_EQ(colour.key.test_voxel, 1u);
  view.channels[0].transfer = {{.value = 0, .color = glm::dvec3(1), .opacity = 1}};
  const Plan scalar = planFor(view, volumeOf(VoxelType::u8, 5, 250));
  EXPECT_EQ(scalar.key.cull, 1u);
  EXPECT_EQ(scalar.key.test_voxel, 0u);  // the table is 0 outside the range
  EXPECT_TRUE(scalar.asksFor(Part::table));
}

TEST(Plan, MaskHoldsExactlyTheBinsOfTheRange) {
  View view;
  view.channels[0].range = DensityRange{64, 95.5};
  EXPECT_EQ(planFor(view, volumeOf(VoxelType::rgba8, 5, 250)).channels[0].range_mask, 0b00000100);
  view.channels[0].range = DensityRange{63, 96};
  EXPECT_EQ(planFor(view, volumeOf(VoxelType::rgba8, 5, 250)).channels[0].range_mask, 0b00001110);
}

VolumeInfo twoChannels() {
  VolumeInfo info = volumeOf(VoxelType::u16, 5, 250);
  info.channels.push_back(info.channels[0]);
  info.channels[1].value_scale = 0.1;
  info.channels[1].density_max = 90;
  return info;
}

TEST(Plan, ChannelsThatShowNothingAreLeftOut) {
  const VolumeInfo info = twoChannels();
  View view;
  EXPECT_EQ(planFor(view, info).key.channels, 2u);
  view.channels[1].range = DensityRange{50, 60};  // above 9, the greatest
  Plan plan = planFor(view, info);
  ASSERT_EQ(plan.channels.size(), 1u);
  EXPECT_EQ(plan.channels[0].channel, 0u);
  view.channels[0].range = DensityRange{-2, -1};
  EXPECT_TRUE(planFor(view, info).is_blank);
  view.channels[1].range = DensityRange{3.5, 4};
  plan = planFor(view, info);
  ASSERT_EQ(plan.channels.size(), 1u);
  EXPECT_EQ(plan.channels[0].channel, 1u);
  EXPECT_EQ(plan.channels[0].range, (StoredRange{.lo = 35, .hi = 40}));
  EXPECT_EQ(plan.channels[0].range_mask, 0b00000010);
}

TEST(Plan, ARangeIsOpenWhereEveryChannelIsDrawnWhole) {
  const VolumeInfo info = twoChannels();
  View view;
  view.mode = Mode::blocks;
  EXPECT_EQ(planFor(view, info).key.range_open, 1u);
  view.drawn = {1};  // a block may be stored for channel 0
  const Plan one = planFor(view, info);
  EXPECT_EQ(one.key.range_open, 0u);
  EXPECT_EQ(one.key.cull, 1u);
  EXPECT_EQ(one.key.channels, 1u);
  view.drawn = {};
  view.channels[1].range = DensityRange{1, 9};
  EXPECT_EQ(planFor(view, info).key.range_open, 0u);
}

TEST(Plan, AnIsoSurfaceIsOfTheFirstChannelDrawn) {
  View view;
  view.mode = Mode::iso;
  view.drawn = {1, 0};
  const Plan plan = planFor(view, twoChannels());
  ASSERT_EQ(plan.channels.size(), 1u);
  EXPECT_EQ(plan.channels[0].channel, 0u);
}

TEST(Plan, ChannelsHaveColoursOfTheirOwn) {
  VolumeInfo info = twoChannels();
  for (ChannelInfo& channel : info.channels) {
    for (std::size_t bin = 0; bin < channel.histogram.size(); ++bin) channel.histogram[bin] = bin < 100 ? 1000 : 10;
  }
  const ResolvedView resolved = resolveView({}, info);
  EXPECT_EQ(resolved.drawn, (std::vector<int>{0, 1}));
  EXPECT_EQ(resolved.channels[0].transfer.front().color, glm::dvec3(0, 89 / 255.0, 0)) << "thin and yet to be seen";
  EXPECT_EQ(resolved.channels[0].transfer.back().color, glm::dvec3(0, 1, 0));
  EXPECT_EQ(resolved.channels[1].transfer.back().color, glm::dvec3(1, 0, 1));
  View one;
  one.drawn = {1};
  EXPECT_EQ(resolveView(one, info).channels[1], resolved.channels[1]);
  info.channels.resize(1);
  EXPECT_NE(resolveView({}, info).channels[0].transfer, resolved.channels[0].transfer);
}

TEST(Plan, EmptyVoxelsAreNeverInTheRange) {
  VolumeInfo info = volumeOf(VoxelType::u8, 41, 250);
  info.channels[0].empty_threshold = 40;
  View view;
  view.mode = Mode::blocks;
  view.channels[0].range = DensityRange{0, 60};
  EXPECT_EQ(visibleRange(resolveView(view, info), info, 0).lo, 41);
  view.channels[0].range = DensityRange{0, 40};
  EXPECT_TRUE(planFor(view, info).is_blank);
}

TEST(Plan, TransparentPartsOfTheTransferFunctionNarrowTheRange) {
  View view;
  view.channels[0].transfer = {{.value = 100, .color = glm::dvec3(1), .opacity = 0},
                               {.value = 120, .color = glm::dvec3(1), .opacity = 0.5},
                               {.value = 140, .color = glm::dvec3(1), .opacity = 0}};
  const VolumeInfo info = volumeOf(VoxelType::u8, 5, 250);
  const StoredRange range = visibleRange(resolveView(view, info), info, 0);
  EXPECT_EQ(range.lo, 100);
  EXPECT_EQ(range.hi, 140);
  view.mode = Mode::blocks;  // counts blocks of the range, whatever they look like
  EXPECT_EQ(visibleRange(resolveView(view, info), info, 0).lo, 1);
}

TEST(Plan, RangeIsInDataUnits) {
  VolumeInfo info = volumeOf(VoxelType::u16, 100, 60000);
  info.channels[0].value_offset = -32768;
  View view;
  view.mode = Mode::blocks;
  view.channels[0].range = DensityRange{-32000, 0};
  const StoredRange range = visibleRange(resolveView(view, info), info, 0);
  EXPECT_EQ(range.lo, 768);
  EXPECT_EQ(range.hi, 32768);
}

TEST(Plan, FloatRangeNeverRoundsOutward) {
  VolumeInfo info = volumeOf(VoxelType::f32, 0.01F, 1);
  View view;
  view.mode = Mode::blocks;
  view.channels[0].range = DensityRange{0.1, 0.7};
  const StoredRange range = visibleRange(resolveView(view, info), info, 0);
  EXPECT_GE(static_cast<double>(range.lo), 0.1);
  EXPECT_LE(static_cast<double>(range.hi), 0.7);
  EXPECT_LT(static_cast<double>(std::nextafter(range.lo, 0.0F)), 0.1);
  EXPECT_GT(static_cast<double>(std::nextafter(range.hi, 1.0F)), 0.7);
}

TEST(Plan, FinderFollowsTheDevice) {
  const VolumeInfo info = volumeOf(VoxelType::rgba8, 5, 250);
  const DeviceTraits gpu{.ray_query = true, .software = false, .max_instances = 1u << 24};
  const DeviceTraits software{.ray_query = true, .software = true, .max_instances = 1u << 24};
  EXPECT_TRUE(planFor({}, info, gpu).asksFor(Part::instances));
  EXPECT_FALSE(planFor({}, info, gpu).asksFor(Part::grid));
  EXPECT_TRUE(planFor({}, info, software).asksFor(Part::grid));
  EXPECT_TRUE(planFor({}, info, {.ray_query = true, .software = false, .max_instances = 4}).asksFor(Part::grid));
  EXPECT_TRUE(planFor({}, info, {.ray_query = true, .software = false, .max_instances = 250, .fastest = Finder::grid})
                  .asksFor(Part::grid));
  EXPECT_TRUE(
      planFor({}, info, {.ray_query = true, .max_instances = 250, .fastest = Finder::query}).asksFor(Part::instances));
  EXPECT_TRUE(planFor({}, info, {.ray_query = true, .max_instances = 4, .fastest = Finder::query}).asksFor(Part::grid));
  View query;
  query.finder = Finder::query;
  EXPECT_THROW(planFor(query, info, {}), ViewError);
  EXPECT_THROW(planFor(query, info, {.ray_query = true, .software = false, .max_instances = 4}), ViewError);
}

constexpr DeviceTraits kSoftwareRays{.ray_query = true, .software = true, .max_instances = 1u << 24};

Plan planWith(Finder finder, const VolumeInfo& info, View view = {}) {
  view.finder = finder;
  return planFor(view, info, kSoftwareRays);
}

TEST(Plan, EachFinderNeedsWhatItLooksIn) {
  const VolumeInfo info = volumeOf(VoxelType::rgba8, 5, 250);
  struct Needs {
    Finder finder;
    bool grid, instances, clusters, boundary, octree, empty, masks;
  };
  for (const Needs& needs : {Needs{Finder::query, false, true, false, false, false, false, false},
                             {Finder::grid, true, false, false, false, false, false, false},
                             {Finder::clusters, true, false, true, false, false, false, true},
                             {Finder::boundary, true, false, false, true, false, false, true},
                             {Finder::octree, false, false, false, false, true, false, false},
                             {Finder::none, true, false, false, false, false, true, false}}) {
    const Plan plan = planWith(needs.finder, info);
    SCOPED_TRACE(finderName(needs.finder));
    EXPECT_EQ(plan.key.finder, static_cast<std::uint32_t>(needs.finder));
    EXPECT_EQ(plan.asksFor(Part::grid), needs.grid);
    EXPECT_EQ(plan.asksFor(Part::instances), needs.instances);
    EXPECT_EQ(plan.asksFor(Part::clusters), needs.clusters);
    EXPECT_EQ(plan.asksFor(Part::boundary), needs.boundary);
    EXPECT_EQ(plan.asksFor(Part::octree), needs.octree);
    EXPECT_EQ(plan.asksFor(Part::empty), needs.empty);
    EXPECT_EQ(plan.asksFor(Part::masks), needs.masks);
    EXPECT_EQ(plan.queriesRays(), needs.instances || needs.clusters || needs.boundary);
    EXPECT_EQ(plan.macrocell_voxels, needs.clusters || needs.boundary ? 8 : 0);
  }
}

TEST(Plan, WithoutSkippingThereIsNeitherWalkNorCull) {
  const VolumeInfo info = volumeOf(VoxelType::rgba8, 5, 250);
  View view;
  view.channels[0].range = DensityRange{100, 200};
  const Plan plan = planWith(Finder::none, info, view);
  EXPECT_EQ(plan.key.cull, 0u);
  EXPECT_FALSE(plan.asksFor(Part::masks));
  for (bool walk : {false, true}) {
    for (bool cull : {false, true}) {
      view.walk = walk;
      view.cull = cull;
      EXPECT_EQ(planWith(Finder::none, info, view).key, plan.key);
    }
  }
}

TEST(Plan, MacrocellsAreWholeSubblocksAndBlocksWhereBlocksAreCounted) {
  VolumeInfo info = volumeOf(VoxelType::rgba8, 5, 250);
  View view;
  EXPECT_EQ(planWith(Finder::boundary, info, view).macrocell_voxels, 8);
  view.macrocell = 32;
  EXPECT_EQ(planWith(Finder::clusters, info, view).macrocell_voxels, 32);
  view.mode = Mode::blocks;
  EXPECT_EQ(planWith(Finder::clusters, info, view).macrocell_voxels, 48);
  view.mode = Mode::blend;
  info.subblock_side = 16;
  view.macrocell = kAutoMacrocell;
  EXPECT_EQ(planWith(Finder::boundary, info, view).macrocell_voxels, 16);
  view.macrocell = 8;
  EXPECT_THROW(planWith(Finder::boundary, info, view), ViewError);
  EXPECT_EQ(planWith(Finder::grid, info, view).macrocell_voxels, 0) << "what the finder does not read is not judged";
  view.macrocell = 12;
  EXPECT_THROW(resolveView(view, info), ViewError);
}

TEST(Plan, WhatTheDeviceCannotFindIsRefused) {
  const auto fieldOf = [](Finder finder, const VolumeInfo& info, const DeviceTraits& device) {
    View view;
    view.finder = finder;
    view.level = 0;
    try {
      planFor(view, info, device);
    } catch (const ViewError& error) {
      return error.field;
    }
    return std::string();
  };
  VolumeInfo info = volumeOf(VoxelType::rgba8, 5, 250);
  for (Finder finder : {Finder::clusters, Finder::boundary}) {
    EXPECT_EQ(fieldOf(finder, info, {}), "finder");
    EXPECT_EQ(fieldOf(finder, info, kSoftwareRays), "");
    info.levels[0].dims = {2048, 2048, 2048};
    EXPECT_EQ(fieldOf(finder, info, kSoftwareRays), "");
    info.levels[0].dims = {2048, 2049, 2048};
    EXPECT_EQ(fieldOf(finder, info, kSoftwareRays), "finder");
    info.levels[0].dims = {512, 512, 512};
  }
  for (Finder finder : {Finder::octree, Finder::none}) EXPECT_EQ(fieldOf(finder, info, {}), "");
}

TEST(Plan, OutputsNeedNoLightAndNoBackground) {
  const VolumeInfo info = volumeOf(VoxelType::rgba8, 5, 250);
  View view;
  view.lit = true;
  view.background = {1, 2, 3, 4};
  EXPECT_EQ(planFor(view, info).key.output, gpu::kOutputColor);
  EXPECT_TRUE(planFor(view, info).apron);
  view.output = Output::depth;
  const Plan depth = planFor(view, info);
  EXPECT_EQ(depth.key.output, gpu::kOutputPoint);
  EXPECT_EQ(depth.key.lit, 0u);
  EXPECT_EQ(depth.key.opaque_background, 1u);
  EXPECT_FALSE(depth.apron);
  view.output = Output::position;  // of the same point
  EXPECT_EQ(planFor(view, info).key, depth.key);
  view.output = Output::cost;
  EXPECT_EQ(planFor(view, info).key.output, gpu::kOutputCost);
  view.output = Output::queries;
  EXPECT_EQ(planFor(view, info).key.output, gpu::kOutputQueries);
  view.output = Output::mesh;  // over the picture
  EXPECT_EQ(planFor(view, info).key.output, gpu::kOutputMesh);
  EXPECT_EQ(planFor(view, info).key.lit, 1u);
}

// The text that the kernel runs, against the truth in double.
TEST(KernelInterface, OpacityIsRelativelyExactForEveryDepth) {
  for (int hundredths = -3000; hundredths < 800; ++hundredths) {
    const auto depth = static_cast<float>(std::pow(10.0, hundredths / 100.0));
    const double truth = -std::expm1(-static_cast<double>(depth));
    EXPECT_NEAR(gpu::opacityOfDepth(depth), truth, 2e-6 * truth) << "depth " << depth;
  }
  EXPECT_EQ(gpu::opacityOfDepth(0), 0);
}

// Few blocks in a box of many: a valid file of a few KiB. Its tiles would be 34 GB, and no float counts them.
TEST(Plan, TilesThatAreTooManyAreRefusedAndNeverChosen) {
  VolumeInfo info = volumeOf(VoxelType::u8, 5, 250);
  info.dims = glm::ivec3(65536);
  info.subblock_side = 4;
  info.block_side = 1;
  info.levels.clear();
  for (int level = 0; level < levelCount(info.dims, info.blockVoxels()); ++level) {
    info.levels.push_back(
        {.dims = levelDims(info.dims, level), .block_count = 1, .subblock_count = 1, .voxel_bytes = 64});
  }
  View view;
  view.level = 0;
  EXPECT_TRUE(planFor(view, info, kSoftwareRays).asksFor(Part::octree));
  EXPECT_TRUE(planFor(view, info, {}).asksFor(Part::octree));
  EXPECT_TRUE(planFor(view, info, {.ray_query = true, .software = false, .max_instances = 4, .fastest = Finder::grid})
                  .asksFor(Part::octree));
  for (const Finder finder : {Finder::grid, Finder::none, Finder::clusters, Finder::boundary}) {
    view.finder = finder;
    try {
      planFor(view, info, kSoftwareRays);
      ADD_FAILURE() << finderName(finder);
    } catch (const ViewError& error) {
      EXPECT_EQ(error.field, "finder");
    }
  }
  // Of level 3 they are 2^24, which is as many as can be counted.
  view.finder = Finder::grid;
  view.level = 3;
  EXPECT_TRUE(planFor(view, info, {}).asksFor(Part::grid));
  view.level = 2;
  EXPECT_THROW(planFor(view, info, {}), ViewError);
}

// What is made of a part comes behind it, and needs that are equal are shared.
TEST(Plan, NeedsAreDataInTheOrderInWhichTheyAreMade) {
  const VolumeInfo info = volumeOf(VoxelType::u8, 5, 250);
  View view;
  view.channels[0].range = DensityRange{100, 200};
  const Plan plan = planWith(Finder::boundary, info, view);
  std::vector<Part> parts;
  for (const Need& need : plan.needs) parts.push_back(need.part);
  EXPECT_EQ(parts, (std::vector<Part>{Part::voxels, Part::blocks, Part::masks, Part::visible_quarters, Part::table,
                                      Part::grid, Part::macrocells, Part::boundary}));
  view.eye = glm::dvec3(1, 2, 300);
  view.background = {1, 2, 3, 4};
  EXPECT_EQ(planWith(Finder::boundary, info, view).needs, plan.needs) << "they do not depend on where one stands";
  view.channels[0].range = DensityRange{100, 201};
  EXPECT_NE(planWith(Finder::boundary, info, view).needs, plan.needs);
}

}  // namespace
}  // namespace blockwalk
