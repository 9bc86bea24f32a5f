// SPDX-License-Identifier: Apache-2.0
#include "protocol/slice_request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "protocol/query_string.h"
#include "protocol/slice_picture.h"

namespace blockwalk {
namespace {

SliceRequest readOf(std::string_view query) { return readSliceRequest(parseQueryString(query)); }

std::string sliceFault(std::string_view query) {
  try {
    readOf(query);
  } catch (const ViewError& error) {
    return error.field + "|" + error.what();
  }
  return "no error";
}

TEST(SliceRequest, IsReadAlongAnAxis) {
  const SliceRequest plain = readOf("axis=z&index=7");
  EXPECT_EQ(plain.cut, (SliceCut{.plane = AxisCut{.axis = 2, .index = 7}}));
  EXPECT_EQ(plain.format, "png");
  const SliceRequest full = readOf(
      "axis=x&index=0&box=0,1,2,9,9,9&thickness=5&reduce=mean&level=2&time=3&channels=2,0&format=webp&"
      "window=1:2;;-3:4&gamma=0.5&colors=;ff0080");
  EXPECT_EQ(full.cut, (SliceCut{.plane = AxisCut{.axis = 0, .thickness = 5, .box = VoxelBox{{0, 1, 2}, {9, 9, 9}}},
                                .reduce = SliceReduce::mean,
                                .level = 2,
                                .channels = {2, 0}}));
  EXPECT_EQ(full.time, 3);
  EXPECT_EQ(full.looks[0].window, (DensityRange{1, 2}));
  EXPECT_EQ(full.looks[1].window, std::nullopt);
  EXPECT_EQ(full.looks[2].window, (DensityRange{-3, 4}));
  EXPECT_EQ(full.looks[0].gamma, 0.5);
  EXPECT_EQ(full.looks[1].color, (Color{255, 0, 128}));
  // As a query again it is the same: how a client sends it on.
  const SliceRequest again = readOf(queryText(full.members));
  EXPECT_EQ(again.cut, full.cut);
  EXPECT_EQ(again.looks, full.looks);
  EXPECT_EQ(again.members, full.members);
}

TEST(SliceRequest, IsReadOfAPlane) {
  const SliceRequest request =
      readOf("centre=1,2,3&right=1,0,0&down=0,1e-3,1&pixel=0.5&size=30x20&thickness=2.5&filter=linear&format=npy");
  EXPECT_EQ(request.cut.plane, (std::variant<AxisCut, PlaneCut>(PlaneCut{.centre = {1, 2, 3},
                                                                         .right = {1, 0, 0},
                                                                         .down = {0, 1e-3, 1},
                                                                         .pixel = 0.5,
                                                                         .width = 30,
                                                                         .height = 20,
                                                                         .thickness = 2.5,
                                                                         .is_linear = true})));
}

TEST(SliceRequest, RefusesByMemberAndBound) {
  const std::string plane = "centre=1,2,3&right=1,0,0&down=0,1,0&pixel=1&size=3x2";
  for (const auto& [query, expected] : {
           std::pair<std::string, std::string>{"", "axis|axis: is missing: x, y or z; or a plane"},
           {"axis=w&index=1", "axis|axis: this version supports x, y and z, not 'w'"},
           {"axis=z", "index|index: is missing: the voxel of level 0"},
           {"axis=z&index=1.5", "index|index: must be a whole number from 0 to 65535"},
           {"axis=z&index=-1", "index|index: must be"},
           {"axis=z&index=99999999999999", "index|index: must be"},
           {"axis=z&index=1&index=1", "index|index: is given twice"},
           {"axis=z&index=1&eye=1,2,3", "eye|eye: is no member of a slice"},
           {"axis=z&index=1&thickness=0", "thickness|thickness: must be a whole number from 1"},
           {"axis=z&index=1&thickness=1.5", "thickness|thickness: must be"},
           {"axis=z&index=1&box=1,2,3", "box|box: must be six numbers"},
           {"axis=z&index=1&reduce=sum", "reduce|reduce: this version supports max, min and mean"},
           {"axis=z&index=1&level=18", "level|level: must be a whole number from 0 to 17"},
           {"axis=z&index=1&time=-1", "time|time: must be"},
           {"axis=z&index=1&channels=0,0", "channels|channels: must name a channel once"},
           {"axis=z&index=1&format=jpeg", "format|format: this version supports png, webp, npy, raw and nrrd"},
           {"axis=z&index=1&window=2:1", "window|window: must be lo:hi with lo <= hi"},
           {"axis=z&index=1&window=0:nan", "window|window: must be finite"},
           {"axis=z&index=1&gamma=0", "gamma|gamma: must be from 0.01 to 100"},
           {"axis=z&index=1&gamma=inf", "gamma|gamma: must be finite"},
           {"axis=z&index=1&colors=red", "colors|colors: must be rrggbb"},
           {"axis=z&index=1&colors=1;2;3;4;5", "colors|colors: must be at most 4 items"},
           {"axis=z&index=1&tf=rainbow", "tf|tf: this version supports"},
           {"axis=z&index=1&tf=grey&window=1:2", "window|window: is given together with tf"},
           {"axis=z&index=1&format=npy&gamma=1", "gamma|gamma: is of pictures, and format npy has values"},
           {"axis=z&index=1&centre=1,2,3", "centre|centre: is of a plane, and axis says an axis"},
           {plane + "&index=1", "index|index: is of a slice along an axis"},
           {plane + "&filter=cubic", "filter|filter: this version supports nearest and linear"},
           {plane + "&thickness=-1", "thickness|thickness: must be at least 0"},
           {"centre=1,2,3&right=1,0,0&down=0,1,0&pixel=0&size=3x2", "pixel|pixel: must be greater than 0"},
           {"centre=1,2,3&right=1,0,0&down=0,1,0&pixel=1&size=8193x2", "size|size: must be a whole number"},
           {"centre=1,2,3&right=1,0,0&down=0,1,0&pixel=1", "size|size: is missing"},
           {"centre=1,2&right=1,0,0", "centre|centre: must be three numbers"},
       }) {
    EXPECT_THAT(sliceFault(query), testing::StartsWith(expected)) << query;
  }
}

// 100 voxels of 0..99, without empty ones among them.
VolumeInfo flatVolume(std::size_t channels = 1) {
  VolumeInfo info;
  info.type = VoxelType::u8;
  info.dims = {2, 1, 1};
  info.levels = {{.dims = info.dims}};
  info.channels.resize(channels);
  for (ChannelInfo& channel : info.channels) {
    channel.empty_threshold = -1;
    channel.value_offset = 10;
    channel.value_scale = 2;
    channel.density_max = 255;
    channel.histogram_hi = 256;
    channel.histogram.fill(1);
  }
  return info;
}

std::vector<std::uint32_t> drawnOf(const VolumeInfo& info, std::string_view query, const SlicePixels& pixels) {
  return slicePicture(info, resolveSlice(readOf(query), info), pixels).pixels;
}

TEST(SlicePicture, StretchesFromBlackToWhite) {
  const VolumeInfo info = flatVolume();
  // Stored 45 and 95 are 100 and 200.
  const SlicePixels pixels{.values = {{45, 95}}, .colors = {}};
  EXPECT_EQ(drawnOf(info, "axis=z&index=0&window=0:400", pixels), (std::vector<std::uint32_t>{0xff404040, 0xff808080}));
  EXPECT_EQ(drawnOf(info, "axis=z&index=0&window=100:200", pixels),
            (std::vector<std::uint32_t>{0xff000000, 0xffffffff}));
  EXPECT_EQ(drawnOf(info, "axis=z&index=0&window=200:200", pixels),
            (std::vector<std::uint32_t>{0xff000000, 0xffffffff}));
  EXPECT_EQ(drawnOf(info, "axis=z&index=0&window=0:400&gamma=2&colors=00ff80", pixels),
            (std::vector<std::uint32_t>{0xff081000, 0xff204000}));
  EXPECT_EQ(drawnOf(info, "axis=z&index=0&tf=0:000000:0,100:ff0000:1,300:0000ff:1", pixels),
            (std::vector<std::uint32_t>{0xff0000ff, 0xff800080}));
  // By default quantiles: 0.35 % of 256 bins, from the start of the histogram.
  const ResolvedSlice plain = resolveSlice(readOf("axis=z&index=0"), info);
  EXPECT_NEAR(plain.looks[0].window.lo, 10 + 2 * 256 * 0.0035, 1e-9);
  EXPECT_NEAR(plain.looks[0].window.hi, 10 + 2 * 256 * 0.998, 1e-9);
  EXPECT_EQ(sliceJson(plain, "u8")["window"], (nlohmann::json{{plain.looks[0].window.lo, plain.looks[0].window.hi}}));
}

TEST(SlicePicture, AddsChannelsInTheirColoursAndIsClearWhereNothingIs) {
  VolumeInfo info = flatVolume(2);
  const float nothing = NAN;
  const SlicePixels pixels{.values = {{95, nothing}, {45, nothing}}, .colors = {}};
  // Green and magenta.
  EXPECT_EQ(drawnOf(info, "axis=z&index=0&window=0:200;0:200", pixels), (std::vector<std::uint32_t>{0xff80ff80, 0}));
  EXPECT_EQ(drawnOf(info, "axis=z&index=0&window=0:200;0:200&channels=1", {.values = {{45, 95}}, .colors = {}}),
            (std::vector<std::uint32_t>{0xff808080, 0xffffffff}))
      << "one channel alone is white, and its window is its own";
  const float endless = std::numeric_limits<float>::infinity();
  EXPECT_EQ(drawnOf(info, "axis=z&index=0&window=0:200;0:200",
                    {.values = {{endless, 95}, {-endless, endless}}, .colors = {}}),
            (std::vector<std::uint32_t>{0, 0xff00ff00}))
      << "what is not finite is no number";
  info.channels[1].color = Color{255, 255, 0};
  EXPECT_EQ(drawnOf(info, "axis=z&index=0&window=0:200;0:200", pixels)[0], 0xff00ff80u);
}

TEST(SlicePicture, LabelsHaveTheirColours) {
  VolumeInfo info = flatVolume();
  ChannelInfo& channel = info.channels[0];
  channel.values = ChannelValues::labels;
  channel.value_offset = 0;
  channel.value_scale = 1;
  channel.empty_threshold = 0;
  channel.density_min = 1;
  channel.density_max = 9;
  channel.labels = {{.value = 7, .name = "liver", .color = Color{1, 2, 3}}};
  const SlicePixels pixels{.values = {{7, 0}}, .colors = {}};
  EXPECT_EQ(drawnOf(info, "axis=z&index=0", pixels), (std::vector<std::uint32_t>{0xff030201, 0}));
  EXPECT_EQ(sliceJson(resolveSlice(readOf("axis=z&index=0"), info), "u8")["window"], nlohmann::json{nullptr});
  EXPECT_EQ(drawnOf(info, "axis=z&index=0&window=0:7", pixels)[0], 0xffffffffu) << "unless a window is asked for";
}

TEST(SlicePicture, RefusesLooksThatTheVolumeHasNot) {
  const auto faultOf = [](const VolumeInfo& info, std::string_view query) -> std::string {
    try {
      resolveSlice(readOf(query), info);
    } catch (const ViewError& error) {
      return error.field + "|" + error.what();
    }
    return "no error";
  };
  VolumeInfo info = flatVolume();
  EXPECT_THAT(faultOf(info, "axis=z&index=0&window=;0:1"), testing::StartsWith("window|is given for channel 1"));
  EXPECT_THAT(faultOf(info, "axis=z&index=0&tf=;grey"), testing::StartsWith("tf|is given for channel 1"));
  EXPECT_THAT(faultOf(info, "axis=z&index=0&time=1"), testing::StartsWith("time|1 is not within 0..0"));
  EXPECT_THAT(faultOf(info, "axis=z&index=1"), testing::StartsWith("index|index: 1 is not within 0..0"));
  info.type = VoxelType::rgba8;
  EXPECT_THAT(faultOf(info, "axis=z&index=0&gamma=1"), testing::StartsWith("gamma|this volume has its own colours"));
}

}  // namespace
}  // namespace blockwalk
