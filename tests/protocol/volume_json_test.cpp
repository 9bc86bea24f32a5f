// SPDX-License-Identifier: Apache-2.0
#include "protocol/volume_json.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "protocol/view_fields.h"
#include "view/resolved_view.h"

namespace blockwalk {
namespace {

VolumeInfo sampleInfo() {
  VolumeInfo info;
  info.type = VoxelType::u16;
  info.dims = {100, 50, 20};
  info.world_from_index = glm::dmat4(0.5);
  info.world_from_index[3] = {1, 2, 3, 1};
  info.channels[0].value_scale = 2;
  info.channels[0].value_offset = -1000;
  info.channels[0].density_min = 10;
  info.channels[0].density_max = 500;
  info.channels[0].histogram_lo = 10;
  info.channels[0].histogram_hi = 500;
  info.channels[0].histogram[0] = 7;
  info.channels[0].histogram[255] = 3;
  info.channels[0].bin_cuts = {1, 2, 3, 4, 5, 6, 7};
  info.channels[0].nonempty_voxels = 10;
  info.metadata.source_name = "sample.raw";
  info.pages = {4, 0, 1};
  info.levels = {{{100, 50, 20}, 4, 9, 9216}, {{50, 25, 10}, 1, 2, 2048}};
  return info;
}

TEST(VolumeJson, SpeaksInDataUnitsAndWorldSpace) {
  const nlohmann::json object = volumeJson(sampleInfo(), 12345);
  EXPECT_EQ(object["name"], "sample.raw");
  EXPECT_EQ(object["type"], "u16");
  EXPECT_EQ(object["dims"], nlohmann::json({100, 50, 20}));
  EXPECT_EQ(object["spacing"], nlohmann::json({0.5, 0.5, 0.5}));
  EXPECT_EQ(object["world_from_index"][2], nlohmann::json({0.0, 0.0, 0.5, 3.0}));
  EXPECT_EQ(object["world_box"], nlohmann::json({1.0, 2.0, 3.0, 51.0, 27.0, 13.0}));
  EXPECT_EQ(object["nonempty_box"], nlohmann::json({0, 0, 0, 100, 50, 20})) << "all of it where all is empty";
  EXPECT_EQ(object["unit_distance"], 0.5);
  EXPECT_EQ(object["density_range"], nlohmann::json({-980.0, 0.0}));
  EXPECT_EQ(object["bin_cuts"][6], -986.0);
  EXPECT_EQ(object["histogram"]["counts"].size(), 256u);
  EXPECT_EQ(object["histogram"]["hi"], 0.0);
  EXPECT_EQ(object["levels"][1], nlohmann::json::parse(R"({"level":1,"dims":[50,25,10],"blocks":1,"subblocks":2,
                                                           "stored_bytes":2048})"));
  EXPECT_EQ(object["stored_bytes"], 11264);
  EXPECT_EQ(object["dense_bytes"], 200000);
  EXPECT_EQ(object["file_bytes"], 12345);
  EXPECT_EQ(object["pages"], nlohmann::json::parse(R"({"raw": 4, "zstd": 1})"));
  EXPECT_EQ(object["nonempty_share"], 1e-4);
}

TEST(VolumeJson, TellsTheMetadataThatAreKnown) {
  VolumeInfo info = sampleInfo();
  EXPECT_EQ(volumeJson(info, 1)["metadata"], nlohmann::json::parse(R"({"source": "sample.raw"})"));
  EXPECT_EQ(volumeJson(info, 1)["values"], "intensity");
  EXPECT_FALSE(volumeJson(info, 1).contains("unit"));
  info.metadata.length_unit = "mm";
  info.metadata.others = {{"scanner", "one"}};
  info.channels[0].values = ChannelValues::labels;
  info.channels[0].unit = "HU";
  info.channels[0].color = Color{255, 0, 1};
  info.channels[0].window = {-1, 2};
  info.channels[0].labels = {{.value = 3, .name = "lung", .color = Color{1, 2, 3}}, {.value = 4, .name = "rib"}};
  const nlohmann::json object = volumeJson(info, 1);
  EXPECT_EQ(object["metadata"],
            nlohmann::json::parse(R"({"source": "sample.raw", "length_unit": "mm", "scanner": "one"})"));
  const nlohmann::json& channel = object["channels"][0];
  EXPECT_EQ(channel["values"], "labels");
  EXPECT_EQ(channel["unit"], "HU");
  EXPECT_EQ(channel["color"], "ff0001");
  EXPECT_EQ(channel["window"], nlohmann::json({-1.0, 2.0}));
  EXPECT_EQ(channel["labels"], nlohmann::json::parse(R"([{"value": 3.0, "name": "lung", "color": "010203"},
                                                         {"value": 4.0, "name": "rib"}])"));
}

TEST(VolumeJson, NamesEveryChannel) {
  VolumeInfo info = sampleInfo();
  const nlohmann::json single = volumeJson(info, 1);
  ASSERT_EQ(single["channels"].size(), 1u);
  for (const char* member : {"value_scale", "value_offset", "empty_threshold", "density_range", "histogram", "bin_cuts",
                             "nonempty_voxels", "nonempty_share", "nonfinite_voxels", "largest_rounding"}) {
    EXPECT_EQ(single["channels"][0][member], single[member]) << member;
  }
  info.channels.push_back({.name = "GFP", .value_offset = 5, .density_min = 1, .density_max = 9});
  info.channels[0].name = "DAPI";
  const nlohmann::json two = volumeJson(info, 1);
  ASSERT_EQ(two["channels"].size(), 2u);
  EXPECT_EQ(two["name"], "sample.raw");
  EXPECT_EQ(two["channels"][0]["name"], "DAPI");
  EXPECT_EQ(two["channels"][1]["name"], "GFP");
  EXPECT_EQ(two["channels"][1]["density_range"], nlohmann::json({6.0, 14.0}));
  EXPECT_EQ(two["density_range"], single["density_range"]);
  EXPECT_EQ(two["stored_bytes"], 2 * 11264);
  EXPECT_EQ(two["levels"][0]["stored_bytes"], 2 * 9216);
  EXPECT_EQ(two["dense_bytes"], 2 * 200000);
}

TEST(VolumeJson, DefaultViewIsAViewOfThisVolume) {
  const nlohmann::json object = volumeJson(sampleInfo(), 1);
  ImageRequest request;
  setViewFields(request, object["default_view"]);
  const ResolvedView expected = resolveView(View{}, sampleInfo());
  EXPECT_EQ(request.view.eye, expected.camera.eye);
  EXPECT_EQ(request.view.channels[0].range, expected.channels[0].range);
  EXPECT_FALSE(request.view.channels[0].transfer.empty());
}

TEST(VolumeJson, TellsWhereItHoldsSomething) {
  VolumeInfo info = sampleInfo();
  info.nonempty = {.begin = {8, 16, 0}, .end = {24, 40, 20}};
  const nlohmann::json object = volumeJson(info, 1);
  EXPECT_EQ(object["nonempty_box"], nlohmann::json({8, 16, 0, 24, 40, 20}));
  EXPECT_EQ(object["default_view"]["target"], nlohmann::json({9.0, 16.0, 8.0}));
}

TEST(VolumeJson, DefaultViewHasAnItemForEachChannel) {
  VolumeInfo info = sampleInfo();
  info.channels.push_back(info.channels[0]);
  info.channels[1].density_max = info.channels[0].density_min + 1;
  const ResolvedView expected = resolveView(View{}, info);
  ImageRequest request;
  setViewFields(request, volumeJson(info, 1)["default_view"]);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(request.view.channels[i].range, expected.channels[i].range);
    EXPECT_EQ(request.view.channels[i].transfer.size(), expected.channels[i].transfer.size());
  }
  EXPECT_NE(request.view.channels[0].range, request.view.channels[1].range);
}

}  // namespace
}  // namespace blockwalk
