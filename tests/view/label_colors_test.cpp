// SPDX-License-Identifier: Apache-2.0
#include "view/label_colors.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "view/resolved_view.h"

namespace blockwalk {
namespace {

ChannelInfo labelsUpTo(float last) {
  ChannelInfo channel;
  channel.values = ChannelValues::labels;
  channel.density_min = 1;
  channel.density_max = last;
  channel.nonempty_voxels = 1;
  return channel;
}

TEST(LabelColors, EachLabelHasItsOwn) {
  const auto points = labelTransfer(labelsUpTo(200));
  ASSERT_EQ(points.size(), 200u);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(points[i].value, static_cast<double>(i + 1));
    EXPECT_EQ(points[i].opacity, points[0].opacity);
    for (int part = 0; part < 3; ++part) {
      EXPECT_LE(points[i].color[part], 1);
      EXPECT_EQ(points[i].color[part] * 255, std::round(points[i].color[part] * 255));
    }
    EXPECT_GE(std::max({points[i].color.r, points[i].color.g, points[i].color.b}), 0.75) << "too dark to see";
    // Its neighbours look different.
    for (std::size_t other = i + 1; other < std::min(points.size(), i + 4); ++other) {
      EXPECT_GT(glm::length(points[i].color - points[other].color), 0.15) << i << " " << other;
    }
  }
}

TEST(LabelColors, AreTheVolumesWhereItSaysThem) {
  ChannelInfo channel = labelsUpTo(4);
  channel.labels = {{.value = 0, .name = "none", .color = Color{9, 9, 9}},
                    {.value = 2, .name = "bone", .color = Color{10, 20, 30}},
                    {.value = 3, .name = "skin"}};
  const auto points = labelTransfer(channel);
  ASSERT_EQ(points.size(), 4u);
  EXPECT_EQ(points[1].color, glm::dvec3(10, 20, 30) / 255.0);
  EXPECT_EQ(points[2].color, labelTransfer(labelsUpTo(4))[2].color);
}

TEST(LabelColors, HaveABound) {
  for (const float last : {1.0f, 1024.0f, 1025.0f, 65535.0f}) {
    const auto points = labelTransfer(labelsUpTo(last));
    EXPECT_GE(points.size(), 1u);
    EXPECT_LE(points.size(), static_cast<std::size_t>(kMostLabelColors));
    EXPECT_LE(points.back().value, static_cast<double>(last));
  }
  // Labels that no float tells from the next.
  ChannelInfo huge = labelsUpTo(1);
  huge.density_min = huge.density_max = 1e17f;
  EXPECT_EQ(labelTransfer(huge).size(), 1u);
  huge.density_max = 3e38f;
  EXPECT_LE(labelTransfer(huge).size(), static_cast<std::size_t>(kMostLabelColors));
  // Those with a colour keep it among however many.
  ChannelInfo many = labelsUpTo(14175);
  many.labels = {{.value = 17, .color = Color{1, 2, 3}}, {.value = 1001, .color = Color{4, 5, 6}}};
  const auto kept = labelTransfer(many);
  EXPECT_LE(kept.size(), static_cast<std::size_t>(kMostLabelColors));
  for (const LabelInfo& label : many.labels) {
    EXPECT_TRUE(std::ranges::any_of(kept, [&](const TransferPoint& point) {
      return point.value == label.value &&
             point.color * 255.0 == glm::dvec3((*label.color)[0], (*label.color)[1], (*label.color)[2]);
    })) << label.value;
  }
  for (std::size_t i = 1; i < kept.size(); ++i) EXPECT_LT(kept[i - 1].value, kept[i].value);
  // A channel without a voxel, or of values that are not whole.
  ChannelInfo odd = labelsUpTo(1);
  odd.density_min = odd.density_max = 0.5f;
  EXPECT_EQ(labelTransfer(odd).size(), 1u);
}

TEST(LabelColors, AreTheDefaultOfLabels) {
  VolumeInfo info;
  info.dims = glm::ivec3(10);
  info.levels = {{.dims = info.dims}};
  info.channels = {labelsUpTo(5)};
  EXPECT_EQ(resolveView({}, info).channels[0].transfer, labelTransfer(info.channels[0]));
}

}  // namespace
}  // namespace blockwalk
