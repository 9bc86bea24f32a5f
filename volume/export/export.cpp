// SPDX-License-Identifier: Apache-2.0
#include "volume/export/export.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include "volume/error.h"
#include "volume/export/export_job.h"
#include "volume/formats/text.h"

namespace blockwalk {
namespace {

// Begins with the volume's name and the option's.
template <typename... Arguments>
[[noreturn]] void failOption(const std::string& name, const char* option, fmt::format_string<Arguments...> format,
                             Arguments&&... arguments) {
  throw ExportError(
      option, fmt::format("{}: {}: {}", name, option, fmt::format(format, std::forward<Arguments>(arguments)...)));
}

VoxelBox checkedBox(const ExportOptions& options, const VolumeInfo& info, const std::string& name) {
  if (!info.has(options.level, Form::values)) {
    failOption(name, "level", "{} is outside 0..{}", options.level, info.levels.size() - 1);
  }
  const glm::ivec3 dims = info.level(options.level, Form::values).dims;
  if (!options.box) return {glm::ivec3(0), dims};
  const VoxelBox& box = *options.box;
  for (int i = 0; i < 3; ++i) {
    if (box.begin[i] < 0 || box.end[i] > dims[i] || box.begin[i] >= box.end[i]) {
      failOption(name, "box", "{}..{} along axis {} is empty or outside 0..{} of level {}", box.begin[i], box.end[i], i,
                 dims[i], options.level);
    }
  }
  return box;
}

std::vector<int> checkedChannels(const ExportOptions& options, const VolumeInfo& info, const std::string& name) {
  std::vector<int> channels = options.channels;
  const auto count = static_cast<int>(info.channels.size());
  for (int i = 0; channels.size() < info.channels.size() && options.channels.empty(); ++i) channels.push_back(i);
  for (const int channel : channels) {
    if (channel < 0 || channel >= count) failOption(name, "channels", "{} is outside 0..{}", channel, count - 1);
    if (std::ranges::count(channels, channel) > 1) failOption(name, "channels", "{} is named twice", channel);
  }
  return channels;
}

// Voxels of level n are 2^n of the finest wide, which is exact.
glm::dmat4 boxPlace(const VolumeInfo& info, int level, const VoxelBox& box) {
  const double voxel = static_cast<double>(std::uint64_t{1} << level);
  glm::dmat4 place = info.world_from_index;
  for (int i = 0; i < 3; ++i) {
    place[3] += info.world_from_index[i] * (voxel * box.begin[i]);
    place[i] *= voxel;
  }
  return place;
}

bool isSigned(const ExportJob& job) {
  const double half = job.type() == VoxelType::u8 ? -128 : job.type() == VoxelType::u16 ? -32768 : 0;
  for (std::size_t i = 0; i < job.channels.size(); ++i) {
    if (job.channel(i).value_scale != 1 || job.channel(i).value_offset != half) return false;
  }
  return half != 0;
}

// No file says what is empty, and import would choose by the values that it sees. In data units as the file has them.
std::string emptyFlags(const ExportJob& job, std::optional<ValueMap> map) {
  std::string flags;
  for (std::size_t i = 0; i < job.channels.size(); ++i) {
    const ChannelInfo& channel = job.channel(i);
    const double stored = static_cast<double>(channel.empty_threshold);
    const double said = map ? map->offset + map->scale * stored : channel.dataFromStored(stored);
    flags += fmt::format("{}{}", i == 0 ? " --empty " : ",", said);
  }
  return flags;
}

std::string importFlags(const ExportJob& job, const Written& written) {
  std::string flags = written.flags + emptyFlags(job, job.is_signed ? std::nullopt : written.map);
  const ChannelValues values = job.channel(0).values;
  bool alike = job.type() != VoxelType::rgba8;
  for (std::size_t i = 0; i < job.channels.size(); ++i) alike = alike && job.channel(i).values == values;
  if (alike) flags += values == ChannelValues::labels ? " --values labels" : " --values intensity";
  return flags.starts_with(' ') ? flags.substr(1) : flags;
}

struct FormatRow {
  ExportFormat format;
  std::string_view name;
  std::vector<std::string_view> endings;  // the first is the usual one; none of folders that are named as one likes
  bool has_signed_types;
  Writer write;
};

const std::vector<FormatRow>& formatRows() {
  static const std::vector<FormatRow> rows{
      {ExportFormat::nrrd, "nrrd", {".nrrd"}, true, writeNrrd},
      {ExportFormat::nifti, "nifti", {".nii", ".nii.gz"}, true, writeNifti},
      {ExportFormat::tiff, "tiff", {".tif", ".tiff"}, false, writeTiff},
      {ExportFormat::zarr, "zarr", {".zarr"}, true, writeZarr},
      {ExportFormat::nanovdb, "nanovdb", {".nvdb"}, false, writeNanoVdb},
      {ExportFormat::npy, "npy", {".npy"}, true, writeNpy},
      {ExportFormat::raw, "raw", {".raw"}, true, writeRaw},
      {ExportFormat::png, "png", {}, false, writePng},
      {ExportFormat::prism, "prism", {".prism"}, false, writePrism},
  };
  return rows;
}

const FormatRow& rowOf(ExportFormat format) { return *std::ranges::find(formatRows(), format, &FormatRow::format); }

}  // namespace

std::optional<ExportFormat> exportFormat(std::string_view name) {
  const auto row = std::ranges::find(formatRows(), name, &FormatRow::name);
  return row == formatRows().end() ? std::nullopt : std::optional(row->format);
}

std::optional<ExportFormat> exportFormatOf(const std::filesystem::path& path) {
  const std::string name = lowerCase((path.has_filename() ? path : path.parent_path()).filename().string());
  for (const FormatRow& row : formatRows()) {
    for (const std::string_view ending : row.endings) {
      if (name.ends_with(ending)) return row.format;
    }
  }
  return std::nullopt;
}

std::vector<std::string> exportFormatNames() {
  std::vector<std::string> names;
  for (const FormatRow& row : formatRows()) names.emplace_back(row.name);
  return names;
}

std::string exportEndings() {
  std::string text;
  for (const FormatRow& row : formatRows()) {
    for (const std::string_view ending : row.endings) text += fmt::format("{}{}", text.empty() ? "" : " ", ending);
  }
  return text;
}

std::uint64_t measureExport(const VolumeInfo& info, const ExportOptions& options, const std::string& name) {
  return checkedBox(options, info, name).voxels() * checkedChannels(options, info, name).size() * voxelBytes(info.type);
}

ExportJob makeExportJob(const VolumeFile& file, const ExportOptions& options) {
  const std::string name = file.path().filename().string();
  const VoxelBox box = checkedBox(options, file.info(), name);
  ExportJob job{.file = file,
                .level = options.level,
                .box = box,
                .channels = checkedChannels(options, file.info(), name),
                .world_from_index = boxPlace(file.info(), options.level, box),
                .progress = options.progress};
  job.is_signed = rowOf(options.format).has_signed_types && isSigned(job);
  return job;
}

ExportReport exportVolume(const VolumeFile& file, const std::filesystem::path& path, const ExportOptions& options) {
  std::error_code absent;
  if (std::filesystem::is_directory(path, absent)) failData("{}: is a folder; none is replaced", path.string());
  if (std::filesystem::exists(path, absent) && !std::filesystem::is_regular_file(path, absent)) {
    failData("{}: is no regular file, and not replaced", path.string());
  }
  const ExportJob job = makeExportJob(file, options);
  const Written written = rowOf(options.format).write(job, path);
  return {.dims = job.box.dims(),
          .channels = job.channels.size(),
          .type = written.type.empty() ? writtenType(job) : written.type,
          .bytes = written.bytes,
          .import_flags = importFlags(job, written),
          .notes = written.notes};
}

}  // namespace blockwalk
