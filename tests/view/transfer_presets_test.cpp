// SPDX-License-Identifier: Apache-2.0
// What a volume looks like that nobody has given colours.
#include <gtest/gtest.h>

#include "view/view.h"

namespace blockwalk {
namespace {

// Values as CT has them: air, soft tissue, and up to `greatest`.
VolumeInfo scan(std::string unit, float greatest) {
  VolumeInfo info;
  info.type = VoxelType::u16;
  info.dims = glm::ivec3(64);
  ChannelInfo channel;
  channel.unit = std::move(unit);
  channel.value_offset = -1000;
  channel.density_min = 1;
  channel.density_max = greatest + 1000;
  channel.histogram_lo = 0;
  channel.histogram_hi = greatest + 1000;
  channel.histogram[2] = 9000;
  channel.histogram[120] = 5000;
  channel.histogram[250] = 500;
  info.channels = {channel};
  return info;
}

double opacityAt(const std::vector<TransferPoint>& points, double value) {
  if (value <= points.front().value) return points.front().opacity;
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (value > points[i].value) continue;
    const double share = (value - points[i - 1].value) / (points[i].value - points[i - 1].value);
    return points[i - 1].opacity + share * (points[i].opacity - points[i - 1].opacity);
  }
  return points.back().opacity;
}

TEST(TransferPresets, CtIsSeenByItsUnit) {
  for (const char* unit : {"HU", "hu", "Hounsfield", "Hounsfield units"}) {
    const VolumeInfo info = scan(unit, 1500);
    const auto points = presetTransfer(TransferPreset::automatic, info, 0);
    EXPECT_EQ(points.size(), presetTransfer(TransferPreset::ct_soft_tissue, info, 0).size()) << unit;
    EXPECT_EQ(opacityAt(points, -900), 0) << "air";
    EXPECT_GT(opacityAt(points, 60), 0) << "muscle";
    EXPECT_GT(opacityAt(points, 700), 3 * opacityAt(points, 60)) << "bone";
  }
}

// A window that the file has is for slices.
TEST(TransferPresets, OfCtAWindowIsNotAsked) {
  VolumeInfo info = scan("HU", 1500);
  info.channels[0].window = {{-160, 240}};
  EXPECT_GT(presetTransfer(TransferPreset::automatic, info, 0).back().value, 240);
  info.channels[0].unit.clear();
  EXPECT_EQ(presetTransfer(TransferPreset::automatic, info, 0).back().value, 240);
}

// clients/web/test/channel_body.test.ts has the same numbers.
TEST(TransferPresets, OfCtTooMapsRunOverTheBody) {
  VolumeInfo info = scan("HU", 1500);
  const auto points = presetTransfer(TransferPreset::viridis, info, 0);
  ASSERT_EQ(points.size(), 11u);
  EXPECT_DOUBLE_EQ(points.front().value, -988.28125);
  EXPECT_DOUBLE_EQ(points.back().value, 1451.171875);
  EXPECT_DOUBLE_EQ(points.back().opacity, 0.4);
  // Half of the way, and as far between what is thin, at -970.703125, and the end.
  EXPECT_DOUBLE_EQ(points[5].value, 231.4453125);
  EXPECT_NEAR(points[5].opacity, 0.2287661, 1e-7);
  info.channels[0].window = {{-160, 240}};
  const auto windowed = presetTransfer(TransferPreset::viridis, info, 0);
  EXPECT_DOUBLE_EQ(windowed.front().value, -160);
  EXPECT_DOUBLE_EQ(windowed[5].value, 40);
  EXPECT_DOUBLE_EQ(windowed[5].opacity, 0.06);
  EXPECT_DOUBLE_EQ(windowed.back().value, 240);
}

TEST(TransferPresets, WhatIsNoCtHasARampOfItsHistogram) {
  VolumeInfo soft = scan("HU", 150);  // no bone: a phantom, or a part of one
  VolumeInfo counts = scan("", 1500);
  VolumeInfo several = scan("HU", 1500);
  several.channels.push_back(several.channels[0]);
  for (const VolumeInfo* info : {&soft, &counts, &several}) {
    EXPECT_EQ(presetTransfer(TransferPreset::automatic, *info, 0).size(), 3u);
  }
}

}  // namespace
}  // namespace blockwalk
