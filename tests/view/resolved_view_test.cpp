// SPDX-License-Identifier: Apache-2.0
#include "view/resolved_view.h"

#include <gtest/gtest.h>

namespace blockwalk {
namespace {

VolumeInfo twoChannels() {
  VolumeInfo info;
  info.type = VoxelType::u8;
  info.dims = {64, 48, 32};
  info.channels.resize(2);
  for (ChannelInfo& channel : info.channels) {
    channel.density_min = 5;
    channel.density_max = 250;
    channel.histogram_hi = 255;
  }
  info.channels[1].density_max = 90;
  info.levels.push_back({.dims = info.dims, .block_count = 1, .subblock_count = 1, .voxel_bytes = 512});
  return info;
}

TEST(ResolvedView, ChoosesEverythingForTheVolume) {
  const ResolvedView view = resolveView({}, twoChannels());
  EXPECT_EQ(view.drawn, (std::vector<int>{0, 1}));
  ASSERT_EQ(view.channels.size(), 2u);
  EXPECT_EQ(view.channels[0].range, (DensityRange{5, 250}));
  EXPECT_EQ(view.channels[1].range, (DensityRange{5, 90}));
  EXPECT_FALSE(view.channels[1].transfer.empty());
  EXPECT_EQ(view.iso, 127.5);
  EXPECT_EQ(view.target, glm::dvec3(32, 24, 16));
  EXPECT_NEAR(glm::length(view.camera.forward), 1, 1e-12);
}

TEST(ResolvedView, SpelledOutItResolvesToTheSame) {
  const VolumeInfo info = twoChannels();
  std::vector<View> views(4);
  views[1].ortho_height = 12.5;
  views[1].eye = glm::dvec3(3, 70, -9);
  views[2].drawn = {1};
  views[2].clip = ClipBox{.min = glm::dvec3(1), .max = glm::dvec3(20)};
  views[2].mode = Mode::iso;
  views[3].width = 333;
  views[3].up = glm::dvec3(0, 0, 2);
  views[3].channels[1].range = DensityRange{7, 8};
  for (const View& view : views) {
    const ResolvedView resolved = resolveView(view, info);
    EXPECT_EQ(resolveView(spellOut(resolved), info), resolved);
  }
}

TEST(ResolvedView, NothingLiesBetweenTwoLabels) {
  VolumeInfo info = twoChannels();
  info.channels[1].values = ChannelValues::labels;
  View view;
  EXPECT_NO_THROW(resolveView(view, info));
  view.filter = Filter::linear;
  try {
    resolveView(view, info);
    FAIL() << "labels are interpolated";
  } catch (const ViewError& error) {
    EXPECT_EQ(error.field, "filter");
    EXPECT_STREQ(error.what(), "linear: channel 1 holds labels, which have no values between them; use nearest");
  }
  view.drawn = {0};  // the labels are not drawn
  EXPECT_NO_THROW(resolveView(view, info));
}

TEST(ResolvedView, RefusesAChannelThatIsNotThere) {
  View view;
  view.channels[2].range = DensityRange{0, 1};
  try {
    resolveView(view, twoChannels());
    FAIL() << "channel 2 of two";
  } catch (const ViewError& error) {
    EXPECT_EQ(error.field, "range");
  }
}

}  // namespace
}  // namespace blockwalk
