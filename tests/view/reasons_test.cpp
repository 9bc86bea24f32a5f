// SPDX-License-Identifier: Apache-2.0
#include "view/reasons.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "view/frame.h"
#include "view/polytope.h"

namespace blockwalk {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

VolumeInfo volumeOf(VoxelType type, std::size_t channels = 1) {
  VolumeInfo info;
  info.type = type;
  info.dims = {64, 48, 32};
  info.channels.resize(channels);
  for (ChannelInfo& channel : info.channels) {
    channel.density_min = 5;
    channel.density_max = 250;
    channel.histogram_hi = 255;
    channel.histogram[100] = 1000;
    channel.nonempty_voxels = 1000;
  }
  info.levels.push_back({.dims = info.dims, .block_count = 1, .subblock_count = 1, .voxel_bytes = 512});
  info.levels.push_back({.dims = info.dims / 2, .block_count = 0, .subblock_count = 0, .voxel_bytes = 0});
  return info;
}

std::vector<std::string> namesOf(const std::vector<Reason>& reasons) {
  std::vector<std::string> names;
  for (const Reason& reason : reasons) names.push_back(reason.name);
  return names;
}

std::vector<std::string> why(const View& view, const VolumeInfo& info) {
  return namesOf(reasonsForNothing(resolveView(view, info), info));
}

ViewChange to(const char* member, const char* value = "auto") { return {.member = member, .value = value}; }

std::vector<ViewChange> changeOf(const View& view, const VolumeInfo& info) {
  return reasonsForNothing(resolveView(view, info), info).at(0).change;
}

// Every choice left out shows something.
TEST(Reasons, AViewWithoutMembersHasNone) {
  for (const VoxelType type : {VoxelType::rgba8, VoxelType::u8, VoxelType::f32}) {
    for (const Mode mode : {Mode::blend, Mode::first_hit, Mode::mip, Mode::minip, Mode::attenuated_mip, Mode::mean,
                            Mode::iso, Mode::blocks}) {
      View view;
      view.mode = mode;
      EXPECT_THAT(why(view, volumeOf(type)), IsEmpty());
      view.ortho_height = 40;
      EXPECT_THAT(why(view, volumeOf(type)), IsEmpty());
    }
  }
}

TEST(Reasons, ACameraThatLooksElsewhere) {
  const VolumeInfo info = volumeOf(VoxelType::u8);
  View view;
  view.eye = glm::dvec3(32, 24, 200);
  view.target = glm::dvec3(32, 24, 300);
  EXPECT_THAT(why(view, info), ElementsAre("camera"));
  EXPECT_THAT(changeOf(view, info), ElementsAre(to("eye"), to("target"), to("up")));
  view.target = glm::dvec3(300, 24, 100);
  EXPECT_THAT(why(view, info), ElementsAre("camera"));
  view.target = glm::dvec3(100, 24, 100);
  EXPECT_THAT(why(view, info), IsEmpty());
  view.fov_degrees = 5;
  EXPECT_THAT(why(view, info), ElementsAre("camera"));
  view.ortho_height = 20;
  EXPECT_THAT(why(view, info), ElementsAre("camera"));
  ASSERT_EQ(changeOf(view, info).size(), 4u);
  EXPECT_EQ(changeOf(view, info)[3].member, "ortho");
  view.eye = glm::dvec3(32, 24, 16);  // in its middle
  EXPECT_THAT(why(view, info), IsEmpty());
}

TEST(Reasons, AVolumeSmallerThanAPixel) {
  const VolumeInfo info = volumeOf(VoxelType::u8);
  View view;
  view.eye = glm::dvec3(1e6, 24, 16);
  EXPECT_THAT(why(view, info), ElementsAre("camera"));
  view.fov_degrees = 0.01;
  EXPECT_THAT(why(view, info), IsEmpty());
  view.eye.reset();
  view.ortho_height = 1e6;
  EXPECT_THAT(why(view, info), ElementsAre("camera"));
  view.fov_degrees = 1e-9;
  view.ortho_height.reset();
  EXPECT_THAT(why(view, info), IsEmpty());
}

// The remedies of a picture that is empty for a reason are a picture that is not.
TEST(Reasons, ARangeBesideTheDensities) {
  const VolumeInfo info = volumeOf(VoxelType::u8, 2);
  View view;
  view.drawn = {0};
  view.channels[0].range = DensityRange{251, 255};
  EXPECT_THAT(why(view, info), ElementsAre("range"));
  EXPECT_THAT(changeOf(view, info), ElementsAre(to("range")));
  view.channels[0].range = DensityRange{250, 255};
  view.mode = Mode::mip;
  EXPECT_THAT(why(view, info), IsEmpty());
  view.channels[0].range = DensityRange{251, 255};
  view.drawn = {};
  EXPECT_THAT(why(view, info), IsEmpty()) << "channel 1 shows something";
  view.channels[1].range = DensityRange{0, 4};
  EXPECT_THAT(why(view, info), ElementsAre("range"));
}

TEST(Reasons, ATransparentTransferFunction) {
  const VolumeInfo info = volumeOf(VoxelType::u8);
  View view;
  view.channels[0].transfer = {{0, glm::dvec3(0), 0}, {255, glm::dvec3(1), 0}};
  EXPECT_THAT(why(view, info), ElementsAre("tf"));
  EXPECT_THAT(changeOf(view, info), ElementsAre(to("tf")));
  view.mode = Mode::mip;
  EXPECT_THAT(why(view, info), IsEmpty()) << "mip does not look at opacity";
  view.mode = Mode::blend;
  view.channels[0].transfer = {{0, glm::dvec3(0), 0}, {251, glm::dvec3(1), 0}, {255, glm::dvec3(1), 1}};
  EXPECT_THAT(why(view, info), ElementsAre("tf")) << "opaque beyond the densities";
  view.channels[0].transfer = {{0, glm::dvec3(0), 0}, {249, glm::dvec3(1), 0}, {255, glm::dvec3(1), 1}};
  EXPECT_THAT(why(view, info), IsEmpty());
  view.transfer_shape = TransferShape::stepped;
  EXPECT_THAT(why(view, info), ElementsAre("tf")) << "0 is held up to 255";
  view.channels[0].transfer = {{0, glm::dvec3(0), 1e-8}};
  EXPECT_THAT(why(view, info), ElementsAre("tf")) << "less than a step of a colour all through the volume";
  view.mode = Mode::first_hit;
  EXPECT_THAT(why(view, info), IsEmpty());
  view.channels[0].range = DensityRange{251, 255};
  view.channels[0].transfer = {{0, glm::dvec3(0), 0}};
  EXPECT_THAT(why(view, info), ElementsAre("range", "tf"));
}

TEST(Reasons, AnExtinctionOfNothing) {
  View view;
  view.extinction = 0;
  EXPECT_THAT(why(view, volumeOf(VoxelType::rgba8)), ElementsAre("extinction"));
  EXPECT_THAT(why(view, volumeOf(VoxelType::u8)), IsEmpty());
  view.mode = Mode::first_hit;
  EXPECT_THAT(why(view, volumeOf(VoxelType::rgba8)), IsEmpty());
}

TEST(Reasons, AnIsoBeyondTheDensities) {
  const VolumeInfo info = volumeOf(VoxelType::u8);
  View view;
  view.mode = Mode::iso;
  view.iso = 251;
  EXPECT_THAT(why(view, info), ElementsAre("iso"));
  EXPECT_THAT(changeOf(view, info), ElementsAre(to("iso")));
  view.iso = -4;
  EXPECT_THAT(why(view, info), IsEmpty()) << "the surface of all of it";
  view.iso.reset();
  view.channels[0].range = DensityRange{300, 400};
  EXPECT_THAT(changeOf(view, info), ElementsAre(to("iso"), to("range")));
}

TEST(Reasons, CutsThatLeaveNothing) {
  VolumeInfo info = volumeOf(VoxelType::u8);
  info.world_from_index[1][0] = 0.4;  // oblique
  View view;
  view.clip = ClipBox{.min = glm::dvec3(0, 0, 33), .max = glm::dvec3(64, 48, 40)};
  EXPECT_THAT(why(view, info), ElementsAre("clip"));
  EXPECT_THAT(changeOf(view, info), ElementsAre(to("clip", "none")));
  view.clip = ClipBox{.min = glm::dvec3(0, 0, 9), .max = glm::dvec3(64, 48, 9)};
  EXPECT_THAT(why(view, info), ElementsAre("clip")) << "flat";
  view.clip = ClipBox{.min = glm::dvec3(66, 0, 0), .max = glm::dvec3(67, 40, 40)};
  EXPECT_THAT(why(view, info), IsEmpty());
  view.planes = {{.normal = {0, 1e-200, 0}, .offset = -47e-200}};
  EXPECT_THAT(why(view, info), ElementsAre("clip")) << "a corner that the other one cuts off";
  EXPECT_THAT(changeOf(view, info), ElementsAre(to("clip", "none"), to("planes", "none")));
  view.clip.reset();
  EXPECT_THAT(why(view, info), IsEmpty());
  view.eye = glm::dvec3(32, 5, 200);
  view.target = glm::dvec3(32, 5, 0);
  view.fov_degrees = 1;
  EXPECT_THAT(why(view, info), ElementsAre("clip")) << "what is left lies outside the picture";
}

TEST(Reasons, ChannelsThatHoldNothing) {
  VolumeInfo info = volumeOf(VoxelType::u8, 2);
  info.channels[1].nonempty_voxels = 0;
  View view;
  EXPECT_THAT(why(view, info), IsEmpty());
  view.drawn = {1};
  view.channels[1].range = DensityRange{300, 400};
  EXPECT_THAT(why(view, info), ElementsAre("channels"));
  EXPECT_THAT(changeOf(view, info), ElementsAre(to("channels", "all")));
  info.channels[0].nonempty_voxels = 0;
  EXPECT_THAT(why(view, info), ElementsAre("channels"));
  EXPECT_THAT(changeOf(view, info), IsEmpty());
}

TEST(Reasons, WhatAFrameKnows) {
  const VolumeInfo info = volumeOf(VoxelType::u8);
  const ResolvedView view = resolveView({}, info);
  RenderStats stats;
  stats.drawn_pixels = 7;
  EXPECT_THAT(reasonsOf(view, info, stats), IsEmpty());
  stats.absent_blocks = 3;
  stats.as_it_is = true;
  EXPECT_THAT(namesOf(reasonsOf(view, info, stats)), ElementsAre("loading"));
  stats.as_it_is = false;
  stats.needed_bytes = 4321;
  stats.room_bytes = 1234;
  EXPECT_THAT(namesOf(reasonsOf(view, info, stats)), ElementsAre("level"));
  EXPECT_THAT(reasonsOf(view, info, stats)[0].detail, testing::HasSubstr("4321 bytes are needed, 1234"));
  stats = {};
  EXPECT_THAT(namesOf(reasonsOf(view, info, stats)), ElementsAre("unseen"));
  EXPECT_THAT(reasonsOf(view, info, stats)[0].change, ElementsAre(to("eye"), to("target"), to("up")));
  stats.level = 1;
  EXPECT_THAT(namesOf(reasonsOf(view, info, stats)), ElementsAre("level")) << "nothing is stored of it";
}

TEST(Polytope, IsWhatHalfSpacesLeave) {
  VolumeInfo info = volumeOf(VoxelType::u8);
  const auto above = [](const glm::dvec3& normal, double offset) {
    return ClipPlane{.normal = normal, .offset = offset};
  };
  EXPECT_TRUE(leavesSome(info, {}));
  for (const double height : {143.9, 144.1}) {  // of the corner along (1, 1, 1)
    const std::vector<ClipPlane> planes = {above({1, 1, 1}, -height)};
    EXPECT_EQ(leavesSome(info, planes), height < 144);
    EXPECT_EQ(leavesSome(info, {}, planes), height < 144);
  }
  const std::vector<ClipPlane> slit = {above({1, 0, 0}, -30), above({-1, 0, 0}, 30 + 1e-13)};
  EXPECT_FALSE(leavesSome(info, slit));
  EXPECT_TRUE(leavesSome(info, {}, slit)) << "a picture may be as narrow as it likes";
}

}  // namespace
}  // namespace blockwalk
