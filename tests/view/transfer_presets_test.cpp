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
