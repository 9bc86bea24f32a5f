// SPDX-License-Identifier: Apache-2.0
#include "view/resolved_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <tuple>

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

// clients/web/test/camera.test.ts has the same numbers: the page frames as the server does.
TEST(ResolvedView, FramesWhatIsNotEmpty) {
  VolumeInfo info = twoChannels();
  info.dims = {96, 80, 64};
  info.world_from_index[2][2] = 2;
  info.nonempty = {.begin = {80, 0, 48}, .end = {96, 16, 64}};
  const auto framed = [&info](int width, int height) {
    View view;
    view.width = width;
    view.height = height;
    return resolveView(view, info);
  };
  EXPECT_EQ(framed(800, 600).target, glm::dvec3(88, 8, 112));
  EXPECT_NEAR(
      glm::length(framed(800, 600).camera.eye - glm::dvec3(119.540049369987, 33.2320394959896, 149.848059243984)), 0,
      1e-10);
  EXPECT_NEAR(
      glm::length(framed(400, 800).camera.eye - glm::dvec3(147.3091654216424, 55.44733233731392, 183.1709985059709)), 0,
      1e-10);
  info.nonempty = {};  // an empty volume is framed as a whole
  EXPECT_EQ(framed(800, 600).target, glm::dvec3(48, 40, 64));
  EXPECT_NEAR(
      glm::length(framed(800, 600).camera.eye - glm::dvec3(196.5969803200154, 158.8775842560123, 242.3163763840184)), 0,
      1e-10);
}

TEST(ResolvedView, APatientStands) {
  VolumeInfo info = twoChannels();
  for (const auto& [space, front, up] :
       {std::tuple{"left-posterior-superior", glm::dvec3(0.7, -1.2, 0.6), glm::dvec3(0, 0, 1)},
        std::tuple{"right-anterior-superior", glm::dvec3(-0.7, 1.2, 0.6), glm::dvec3(0, 0, 1)},
        std::tuple{"superior-left-posterior-time", glm::dvec3(0.6, 0.7, -1.2), glm::dvec3(1, 0, 0)},
        std::tuple{"left-left-superior", glm::dvec3(1, 0.8, 1.2), glm::dvec3(0, 1, 0)},
        std::tuple{"left-posterior", glm::dvec3(1, 0.8, 1.2), glm::dvec3(0, 1, 0)},
        std::tuple{"3D-right-handed", glm::dvec3(1, 0.8, 1.2), glm::dvec3(0, 1, 0)},
        std::tuple{"", glm::dvec3(1, 0.8, 1.2), glm::dvec3(0, 1, 0)}}) {
    info.metadata.space = space;
    const ResolvedView view = resolveView({}, info);
    EXPECT_NEAR(glm::length(glm::normalize(view.camera.eye - view.target) - glm::normalize(front)), 0, 1e-12) << space;
    EXPECT_EQ(view.up, up) << space;
    // Who says what is up, says it.
    View turned;
    turned.up = glm::dvec3(1, 0, 0);
    EXPECT_EQ(resolveView(turned, info).up, glm::dvec3(1, 0, 0));
  }
}

// What the source says to show first.
TEST(ResolvedView, KeepsColoursAndWindowsOfTheSource) {
  VolumeInfo info = twoChannels();
  info.channels[0].color = Color{0, 128, 255};
  info.channels[0].window = {20, 120};
  const std::vector<TransferPoint> points = resolveView({}, info).channels[0].transfer;
  EXPECT_EQ(points.front().value, 20);
  EXPECT_EQ(points.front().opacity, 0);
  EXPECT_EQ(points.back().value, 120);
  EXPECT_EQ(points.back().color, glm::dvec3(0, 128, 255) / 255.0);
  info.channels[0].window = {50, 50};  // none
  EXPECT_NE(resolveView({}, info).channels[0].transfer.front().value, 50);
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

TEST(ResolvedView, RefusesLightAndLensesThatAreNone) {
  const auto blamed = [](auto change) {
    View view;
    change(view);
    try {
      resolveView(view, twoChannels());
    } catch (const ViewError& error) {
      return error.field;
    }
    return std::string();
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {-0.1, 10.5, nan}) {
    EXPECT_EQ(blamed([&](View& view) { view.lights.ambient = bad; }), "light");
    EXPECT_EQ(blamed([&](View& view) { view.lights.highlight = bad; }), "light");
  }
  EXPECT_EQ(blamed([](View& view) { view.key_light = glm::dvec3(0); }), "key-light");
  EXPECT_EQ(blamed([&](View& view) { view.key_light.y = nan; }), "key-light");
  for (const double bad : {-1.0, 2e6, nan}) EXPECT_EQ(blamed([&](View& view) { view.occlusion = bad; }), "occlusion");
  for (const double bad : {-1.0, 1e3, nan}) EXPECT_EQ(blamed([&](View& view) { view.aperture = bad; }), "aperture");
  EXPECT_EQ(blamed([](View& view) { view.aperture = 1, view.ortho_height = 100; }), "aperture");
  for (const double bad : {-1.0, nan, std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(blamed([&](View& view) { view.focus = bad; }), "focus");
  }
  EXPECT_EQ(blamed([](View& view) {
              view.lights = {.ambient = 0, .head = 10, .key = 0, .highlight = 0};
              view.occlusion = 1e6;
              view.aperture = 80;
              view.focus = 1e-3;
            }),
            "");
}

}  // namespace
}  // namespace blockwalk
