// SPDX-License-Identifier: Apache-2.0
#include "protocol/volume_json.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>

#include "protocol/view_values.h"
#include "view/resolved_view.h"
#include "volume/codec_name.h"

namespace blockwalk {
namespace {

using nlohmann::json;

json vectorJson(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

json boxJson(const VoxelBox& box) { return {box.begin.x, box.begin.y, box.begin.z, box.end.x, box.end.y, box.end.z}; }

json transformJson(const glm::dmat4& transform) {
  json rows = json::array();
  for (int row = 0; row < 3; ++row) {
    rows.push_back({transform[0][row], transform[1][row], transform[2][row], transform[3][row]});
  }
  return rows;
}

std::string colorText(const Color& color) { return fmt::format("{:02x}{:02x}{:02x}", color[0], color[1], color[2]); }

json levelsJson(const VolumeInfo& info) {
  json levels = json::array();
  for (std::size_t n = 0; n < info.levels.size(); ++n) {
    const LevelInfo& level = info.levels[n];
    levels.push_back({{"level", n},
                      {"dims", {level.dims.x, level.dims.y, level.dims.z}},
                      {"blocks", level.block_count},
                      {"subblocks", level.subblock_count},
                      {"stored_bytes", level.voxel_bytes * info.channels.size()}});
  }
  return levels;
}

// The view that a client shows first: resolveView's choice for a view that says nothing.
json defaultViewJson(const VolumeInfo& info) {
  const ResolvedView view = resolveView(View{}, info);
  json object = {{"eye", vectorJson(view.camera.eye)},
                 {"target", vectorJson(view.target)},
                 {"up", vectorJson(view.up)},
                 {"fov", view.fov_degrees}};
  json ranges = json::array();
  json transfers = json::array();
  for (const ResolvedChannel& channel : view.channels) {
    ranges.push_back({channel.range.lo, channel.range.hi});
    if (!channel.transfer.empty()) transfers.push_back(transferText(channel.transfer));
  }
  const bool single = info.channels.size() == 1;
  object["range"] = single ? ranges[0] : ranges;
  if (!transfers.empty()) object["tf"] = single ? transfers[0] : transfers;
  return object;
}

// How many pages of the file are packed how.
json pagesJson(const VolumeInfo& info) {
  json pages = json::object();
  for (std::size_t i = 0; i < info.pages.size(); ++i) {
    if (info.pages[i] > 0) pages[std::string(codecName(static_cast<Codec>(i)))] = info.pages[i];
  }
  return pages;
}

std::uint64_t storedBytes(const VolumeInfo& info) {
  std::uint64_t bytes = 0;
  for (const LevelInfo& level : info.levels) bytes += level.voxel_bytes * info.channels.size();
  return bytes;
}

std::uint64_t voxelCount(const VolumeInfo& info) {
  return static_cast<std::uint64_t>(info.dims.x) * static_cast<std::uint64_t>(info.dims.y) *
         static_cast<std::uint64_t>(info.dims.z);
}

// The values of one channel, in data units.
json channelJson(const ChannelInfo& channel, std::uint64_t voxels) {
  const auto data = [&](float stored) { return channel.dataFromStored(static_cast<double>(stored)); };
  json cuts = json::array();
  for (float cut : channel.bin_cuts) cuts.push_back(data(cut));
  json object = {
      {"name", channel.name},
      {"value_scale", channel.value_scale},
      {"value_offset", channel.value_offset},
      {"empty_threshold", data(channel.empty_threshold)},
      {"density_range", {data(channel.density_min), data(channel.density_max)}},
      {"histogram",
       {{"lo", data(channel.histogram_lo)}, {"hi", data(channel.histogram_hi)}, {"counts", channel.histogram}}},
      {"bin_cuts", std::move(cuts)},
      {"nonempty_voxels", channel.nonempty_voxels},
      {"nonempty_share",
       voxels == 0 ? 0.0 : static_cast<double>(channel.nonempty_voxels) / static_cast<double>(voxels)},
      {"nonfinite_voxels", channel.nonfinite_voxels},
      {"largest_rounding", channel.largest_rounding}};
  object["values"] = channel.values == ChannelValues::labels ? "labels" : "intensity";
  if (!channel.unit.empty()) object["unit"] = channel.unit;
  if (channel.color) object["color"] = colorText(*channel.color);
  if (channel.window) object["window"] = *channel.window;
  for (const LabelInfo& label : channel.labels) {
    json entry = {{"value", label.value}, {"name", label.name}};
    if (label.color) entry["color"] = colorText(*label.color);
    object["labels"].push_back(std::move(entry));
  }
  return object;
}

// What is known of where the volume comes from and what its world is.
json metadataJson(const Metadata& metadata) {
  json object = json::object();
  const auto add = [&](const std::string& key, const std::string& value) {
    if (!value.empty()) object[key] = value;
  };
  add("source", metadata.source_name);
  add("source_kind", metadata.source_kind);
  add("length_unit", metadata.length_unit);
  add("space", metadata.space);
  for (const auto& [key, value] : metadata.others) add(key, value);
  return object;
}

}  // namespace

json volumeJson(const VolumeInfo& info, std::uint64_t file_bytes) {
  json channels = json::array();
  for (const ChannelInfo& channel : info.channels) channels.push_back(channelJson(channel, voxelCount(info)));
  // The first channel's values are the volume's own members too: of most volumes it is the only one.
  json object = channels[0];
  json spacing = json::array();
  for (int axis = 0; axis < 3; ++axis) spacing.push_back(glm::length(glm::dvec3(info.world_from_index[axis])));
  const WorldBox box = worldBox(info);
  object.update({{"name", info.metadata.source_name},
                 {"type", voxelTypeName(info.type)},
                 {"dims", {info.dims.x, info.dims.y, info.dims.z}},
                 {"spacing", std::move(spacing)},
                 {"world_from_index", transformJson(info.world_from_index)},
                 {"world_box", {box.min.x, box.min.y, box.min.z, box.max.x, box.max.y, box.max.z}},
                 {"nonempty_box", boxJson(nonemptyBox(info))},
                 {"unit_distance", unitDistance(info)},
                 {"subblock_side", info.subblock_side},
                 {"block_side", info.block_side},
                 {"levels", levelsJson(info)},
                 {"steps", info.steps},
                 {"stored_bytes", storedBytes(info)},
                 {"dense_bytes", voxelCount(info) * voxelBytes(info.type) * info.channels.size()},
                 {"file_bytes", file_bytes},
                 {"pages", pagesJson(info)},
                 {"source", info.metadata.source_name},
                 {"metadata", metadataJson(info.metadata)},
                 {"default_view", defaultViewJson(info)},
                 {"channels", std::move(channels)}});
  return object;
}

}  // namespace blockwalk
