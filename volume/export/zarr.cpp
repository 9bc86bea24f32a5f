// SPDX-License-Identifier: Apache-2.0
// OME-Zarr 0.5 (ngff.openmicroscopy.org/0.5): a group of arrays, the finest first, each a folder of files.
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "volume/build/storage.h"
#include "volume/error.h"
#include "volume/export/export_job.h"
#include "volume/export/output_folder.h"
#include "volume/export/zarr_shards.h"
#include "volume/formats/length_unit.h"

namespace blockwalk {
namespace {

using nlohmann::json;

// As UDUNITS-2 spells those that OME-Zarr knows; nothing for others.
std::string spelledUnit(const std::string& said) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 12> kSpelled{{{"angstrom", "angstrom"},
                                                                                    {"pm", "picometer"},
                                                                                    {"nm", "nanometer"},
                                                                                    {"um", "micrometer"},
                                                                                    {"mm", "millimeter"},
                                                                                    {"cm", "centimeter"},
                                                                                    {"dm", "decimeter"},
                                                                                    {"m", "meter"},
                                                                                    {"km", "kilometer"},
                                                                                    {"in", "inch"},
                                                                                    {"ft", "foot"},
                                                                                    {"yd", "yard"}}};
  const std::string name = lengthUnit(said).name;
  for (const auto& [unit, spelled] : kSpelled) {
    if (name == unit) return std::string(spelled);
  }
  return {};
}

json axesOf(const ExportJob& job, bool has_fields, Written& written) {
  json axes = json::array();
  if (has_fields) axes.push_back({{"name", "c"}, {"type", "channel"}});
  const std::string& said = job.file.info().metadata.length_unit;
  const std::string unit = spelledUnit(said);
  if (!said.empty() && unit.empty()) {
    written.notes.push_back(fmt::format("OME-Zarr has no unit of length '{}': it is not kept", said));
  }
  for (const char* name : {"z", "y", "x"}) {
    axes.push_back({{"name", name}, {"type", "space"}});
    if (!unit.empty()) axes.back()["unit"] = unit;
  }
  return axes;
}

// Centres of voxels, as the standard counts; the corner of the box is that of every level.
json zarrPlace(const ExportJob& job, bool has_fields) {
  const glm::dvec3 spacing = job.spacing();
  json scale = json::array();
  json translation = json::array();
  if (has_fields) {
    scale.push_back(1.0);
    translation.push_back(0.0);
  }
  for (const int i : {2, 1, 0}) {
    scale.push_back(spacing[i]);
    translation.push_back((job.isAligned() ? job.world_from_index[3][i] : 0.0) + 0.5 * spacing[i]);
  }
  return json::array({{{"type", "scale"}, {"scale", scale}}, {{"type", "translation"}, {"translation", translation}}});
}

std::string hexColor(const Color& color) { return fmt::format("{:02X}{:02X}{:02X}", color[0], color[1], color[2]); }

json omeroChannels(const ExportJob& job) {
  json channels = json::array();
  if (job.type() == VoxelType::rgba8) {
    constexpr std::array kNames{"red", "green", "blue", "alpha"};
    constexpr std::array<Color, 4> kColors{Color{255, 0, 0}, Color{0, 255, 0}, Color{0, 0, 255}, Color{255, 255, 255}};
    for (std::size_t i = 0; i < 4; ++i) {
      channels.push_back({{"label", kNames[i]},
                          {"color", hexColor(kColors[i])},
                          {"active", true},
                          {"window", {{"start", 0}, {"end", 255}, {"min", 0}, {"max", 255}}}});
    }
    return channels;
  }
  // Viewers show these; where the volume has none they are the first four that it is shown in here.
  constexpr std::array<Color, kMaxChannels> kShown{Color{0, 255, 0}, Color{255, 0, 255}, Color{0, 255, 255},
                                                   Color{255, 255, 0}};
  for (std::size_t i = 0; i < job.channels.size(); ++i) {
    const ChannelInfo& channel = job.channel(i);
    const auto value = [&](float stored) {
      return job.is_signed ? channel.dataFromStored(static_cast<double>(stored)) : static_cast<double>(stored);
    };
    json entry = {{"active", true}};
    entry["color"] = hexColor(channel.color.value_or(job.channels.size() > 1 ? kShown[i] : Color{255, 255, 255}));
    if (!channel.name.empty()) entry["label"] = channel.name;
    double lo = value(channel.density_min);
    double hi = value(channel.density_max);
    json window = {{"min", lo}, {"max", hi}};
    if (channel.window && (job.is_signed || (channel.value_scale == 1 && channel.value_offset == 0))) {
      lo = (*channel.window)[0];
      hi = (*channel.window)[1];
    }
    window["start"] = lo;
    window["end"] = hi;
    entry["window"] = window;
    channels.push_back(entry);
  }
  return channels;
}

json imageLabel(const ChannelInfo& channel) {
  json label = {{"version", "0.5"}, {"colors", json::array()}, {"properties", json::array()}};
  for (const LabelInfo& known : channel.labels) {
    const auto value = static_cast<std::int64_t>(known.value);
    if (known.color) {
      const Color& color = *known.color;
      label["colors"].push_back({{"label-value", value}, {"rgba", {color[0], color[1], color[2], 255}}});
    }
    if (!known.name.empty()) label["properties"].push_back({{"label-value", value}, {"name", known.name}});
  }
  return label;
}

std::uint64_t writeJson(const json& value, const std::filesystem::path& path) {
  const std::string text = value.dump(2, ' ', false, json::error_handler_t::replace) + "\n";
  OutputFile file(path);
  file.write(0, std::as_bytes(std::span(text)));
  file.commit();
  return text.size();
}

// The level that was asked for, and where it is whole those that are coarser.
std::vector<ExportJob> levelsOf(const ExportJob& job) {
  std::vector<ExportJob> levels{job};
  const VolumeInfo& info = job.file.info();
  if (job.box != VoxelBox{glm::ivec3(0), info.level(job.level, Form::values).dims}) return levels;
  for (int level = job.level + 1; level < static_cast<int>(info.levels.size()); ++level) {
    ExportJob next = levels.back();
    next.level = level;
    next.box = {glm::ivec3(0), info.level(level, Form::values).dims};
    for (int i = 0; i < 3; ++i) next.world_from_index[i] *= 2;
    levels.push_back(next);
  }
  return levels;
}

void noteZarrLosses(const ExportJob& job, Written& written) {
  if (!job.isAligned()) noteSpacingAlone(job, written.notes);
  noteSpace(job, written.notes);
  noteStoredValues(job, written.notes);
  noteValueUnits(job, written.notes);
}

}  // namespace

Written writeZarr(const ExportJob& job, const std::filesystem::path& path) {
  const bool is_color = job.type() == VoxelType::rgba8;
  const bool has_fields = is_color || job.channels.size() > 1;
  OutputFolder folder(path);
  Written written;
  const std::vector<ExportJob> levels = levelsOf(job);
  std::uint64_t shards = 0;
  std::uint64_t done = 0;
  for (const ExportJob& level : levels) shards += zarrShards(level);
  json datasets = json::array();
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const std::string name = fmt::format("{}", i);
    const auto below = folder.partialPath() / name;
    std::filesystem::create_directory(below);
    written.bytes += writeJson(zarrArray(levels[i]), below / "zarr.json");
    written.bytes += writeZarrChunks(levels[i], below, [&] {
      if (job.progress) job.progress("write", ++done, shards);
    });
    datasets.push_back({{"path", name}, {"coordinateTransformations", zarrPlace(levels[i], has_fields)}});
  }
  json ome = {{"version", "0.5"}};
  ome["multiscales"] = json::array({{{"name", job.file.path().stem().string()},
                                     {"axes", axesOf(job, has_fields, written)},
                                     {"datasets", datasets}}});
  ome["omero"] = {{"channels", omeroChannels(job)}};
  if (job.isLabels()) ome["image-label"] = imageLabel(job.channel(0));
  written.bytes += writeJson({{"zarr_format", 3}, {"node_type", "group"}, {"attributes", {{"ome", ome}}}},
                             folder.partialPath() / "zarr.json");
  folder.commit();
  if (is_color) written.flags = "--channels color";
  noteZarrLosses(job, written);
  return written;
}

}  // namespace blockwalk
