// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "clients/cli/access_flags.h"
#include "clients/cli/commands.h"
#include "clients/cli/flag_values.h"
#include "clients/cli/remote.h"
#include "clients/cli/usage_error.h"
#include "protocol/render_json.h"
#include "protocol/volume_json.h"
#include "renderer/driver.h"
#include "renderer/level_needs.h"
#include "renderer/renderer.h"
#include "volume/file/file.h"
#include "volume/import/source_facts.h"

namespace blockwalk {
namespace {

using nlohmann::json;

template <typename T>
std::string joined(const json& values, std::string_view separator) {
  return fmt::format("{}", fmt::join(values.get<std::vector<T>>(), separator));
}

// 64 columns of the histogram, each as high as the logarithm of its count: rare values are what ranges are for.
std::string histogramLine(const json& counts) {
  constexpr std::array<std::string_view, 9> kBars = {" ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  constexpr std::size_t kColumns = 64;
  const auto values = counts.get<std::vector<std::uint64_t>>();
  std::vector<double> columns(kColumns, 0);
  for (std::size_t i = 0; i < values.size(); ++i)
    columns[i * kColumns / values.size()] += static_cast<double>(values[i]);
  double highest = 0;
  for (double& column : columns) {
    column = std::log1p(column);
    highest = std::max(highest, column);
  }
  std::string line;
  for (const double column : columns) {
    line += kBars[highest > 0 ? static_cast<std::size_t>(std::ceil(column / highest * 8)) : 0];
  }
  return line;
}

// Text that may not be there; nothing of older servers.
std::string textOf(const json& object, const char* member) {
  const auto found = object.find(member);
  return found == object.end() || !found->is_string() ? std::string() : found->get<std::string>();
}

// What a channel holds.
void printValues(const json& channel) {
  const json& histogram = channel.at("histogram");
  const std::string values = textOf(channel, "values");
  const std::string unit = textOf(channel, "unit");
  if (values == "labels") fmt::print("values            labels\n");
  if (!unit.empty()) fmt::print("unit              {}\n", unit);
  fmt::print("density           {} (empty up to {})\n", joined<double>(channel.at("density_range"), " .. "),
             channel.at("empty_threshold").get<double>());
  fmt::print("non-empty         {} voxels ({:.2f} %)\n", channel.at("nonempty_voxels").get<std::uint64_t>(),
             100 * channel.at("nonempty_share").get<double>());
  fmt::print("mask cuts         {}\n", joined<double>(channel.at("bin_cuts"), " "));
  fmt::print("not finite        {} voxels, largest rounding {}\n", channel.at("nonfinite_voxels").get<std::uint64_t>(),
             channel.at("largest_rounding").get<double>());
  fmt::print("histogram         {} .. {}\n  {}\n", histogram.at("lo").get<double>(), histogram.at("hi").get<double>(),
             histogramLine(histogram.at("counts")));
}

// How many pages are packed how; nothing of older servers.
void printPages(const json& volume) {
  const auto pages = volume.find("pages");
  if (pages == volume.end() || pages->empty()) return;
  std::string text;
  for (const auto& [codec, count] : pages->items()) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count.get<std::uint64_t>(), codec);
  }
  fmt::print("pages             {}\n", text);
}

// As far as a subblock's bytes depend on it.
VolumeInfo voxelShape(const json& volume) {
  VolumeInfo shape;
  for (const VoxelType type : {VoxelType::rgba8, VoxelType::u8, VoxelType::u16, VoxelType::f32}) {
    if (voxelTypeName(type) == volume.at("type").get<std::string>()) shape.type = type;
  }
  shape.subblock_side = volume.at("subblock_side").get<int>();
  shape.channels.resize(volume.at("channels").size());
  return shape;
}

void printMetadata(const json& volume) {
  const auto metadata = volume.find("metadata");
  if (metadata == volume.end()) return;
  for (const auto& [key, value] : metadata->items()) {
    if (key != "source" && key != kSpacingFromKey) fmt::print("{:<17} {}\n", key, value.get<std::string>());
  }
}

// With the fields that say it, where the volume knows them.
void printSpacing(const json& volume) {
  const auto metadata = volume.find("metadata");
  const std::string from =
      metadata == volume.end() ? std::string() : textOf(*metadata, std::string(kSpacingFromKey).c_str());
  fmt::print("spacing           {}{}\n", joined<double>(volume.at("spacing"), " x "),
             from.empty() ? "" : " (" + from + ")");
}

// With what a view of each level takes on the device.
void printLevels(const json& volume) {
  const VolumeInfo shape = voxelShape(volume);
  fmt::print("\n{:>89}\n", "on the device");
  fmt::print("level  size                   blocks    subblocks       stored      nearest       linear      records\n");
  for (const json& level : volume.at("levels")) {
    const LevelInfo counts{.block_count = level.at("blocks").get<std::uint64_t>(),
                           .subblock_count = level.at("subblocks").get<std::uint64_t>()};
    const LevelNeeds needs = levelNeeds(shape, counts);
    fmt::print("{:>5}  {:<18} {:>10} {:>12} {:>12} {:>12} {:>12} {:>12}\n", level.at("level").get<int>(),
               joined<int>(level.at("dims"), " x "), counts.block_count, counts.subblock_count,
               byteText(level.at("stored_bytes").get<std::uint64_t>()), byteText(needs.nearest_bytes),
               byteText(needs.linear_bytes), byteText(needs.record_bytes));
  }
}

void printTable(const json& volume) {
  const auto bytes = [&](const char* member) { return byteText(volume.at(member).get<std::uint64_t>()); };
  const json& channels = volume.at("channels");
  fmt::print("name              {}\n", volume.at("name").get<std::string>());
  fmt::print("size              {} voxels of {}{}\n", joined<int>(volume.at("dims"), " x "),
             channels.size() > 1 ? fmt::format("{} x ", channels.size()) : "", volume.at("type").get<std::string>());
  if (const int steps = volume.value("steps", 1); steps > 1) {
    fmt::print("steps             {}, in time; counts, sizes and levels below are the first's, densities are of all\n",
               steps);
  }
  printMetadata(volume);
  printSpacing(volume);
  fmt::print("world box         {}\n", joined<double>(volume.at("world_box"), " "));
  fmt::print("non-empty in      {} (voxels)\n", joined<int>(volume.at("nonempty_box"), " "));
  fmt::print("blocks            {} subblocks of {} voxels a side\n", volume.at("block_side").get<int>(),
             volume.at("subblock_side").get<int>());
  fmt::print("stored            {} of {} dense, file {}\n", bytes("stored_bytes"), bytes("dense_bytes"),
             bytes("file_bytes"));
  printPages(volume);
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (channels.size() > 1) fmt::print("\nchannel {}         {}\n", i, channels[i].at("name").get<std::string>());
    printValues(channels[i]);
  }
  printLevels(volume);
}

void printDevice(const DeviceInfo& device, const DriverSetUp& driver) {
  fmt::print("device            {} ({})\n", device.name, device.kind);
  fmt::print("driver            {} {}, Vulkan {}\n", device.driver, device.driver_version, device.api_version);
  fmt::print("ray queries       {}\n", device.ray_query ? "yes" : "no");
  fmt::print("subgroup          {} lanes\n", device.subgroup_size);
  fmt::print("memory            {}\n", byteText(device.memory_budget_bytes));
  fmt::print("set up            {}\n", driver.note);
}

struct InfoCommand {
  std::string source;
  bool as_json = false;
  AccessFlags server;
  bool device = false;

  void runDevice() const {
    const DriverSetUp driver = setUpDriver();
    const DeviceInfo info = createRenderer({})->device();
    if (!as_json) return printDevice(info, driver);
    json all = deviceJson(info);
    all["set_up"] = driver.note;
    fmt::print("{}\n", all.dump(2));
  }

  json describe() const {
    if (isUrl(source)) return fetchVolume(parseVolumeUrl(source), server.access());
    server.refuseFor(source);
    const VolumeFile file(source);
    return volumeJson(file.info(), file.fileBytes());
  }

  void run() const {
    if (source.empty() != device) throw UsageError("FILE|URL: name a volume, or else --device");
    if (device) return runDevice();
    const json volume = describe();
    if (as_json) {
      fmt::print("{}\n", volume.dump(2));
      return;
    }
    try {
      printTable(volume);
    } catch (const json::exception& error) {
      throw std::runtime_error(fmt::format("{}: the server describes the volume otherwise: {}", source, error.what()));
    }
  }
};

}  // namespace

void addInfoCommand(CLI::App& app) {
  auto info = std::make_shared<InfoCommand>();
  CLI::App* command = app.add_subcommand("info", "Say what a volume is, or the device");
  command->add_option("FILE|URL", info->source, "a .bwv file, or http(s)://HOST:PORT/ID");
  command->add_flag("--device", info->device, "the device that draws here, instead of a volume");
  command->add_flag("--json", info->as_json, "everything, as JSON");
  info->server.addTo(*command);
  command->callback([info] { info->run(); });
}

}  // namespace blockwalk
