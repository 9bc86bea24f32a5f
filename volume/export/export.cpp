// SPDX-License-Identifier: Apache-2.0
#include "volume/export/export.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include "volume/error.h"
#include "volume/export/export_job.h"

namespace blockwalk {
namespace {

VoxelBox checkedBox(const ExportOptions& options, glm::ivec3 dims, const std::string& name) {
  if (!options.box) return {glm::ivec3(0), dims};
  const VoxelBox& box = *options.box;
  for (int i = 0; i < 3; ++i) {
    if (box.begin[i] < 0 || box.end[i] > dims[i] || box.begin[i] >= box.end[i]) {
      failData("{}: box: {}..{} along axis {} is empty or outside 0..{} of level {}", name, box.begin[i], box.end[i], i,
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
    if (channel < 0 || channel >= count) failData("{}: channels: {} is outside 0..{}", name, channel, count - 1);
    if (std::ranges::count(channels, channel) > 1) failData("{}: channels: {} is named twice", name, channel);
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

void checkPrism(const ExportJob& job, const std::string& name) {
  if (job.type() != VoxelType::u8 && job.type() != VoxelType::u16) {
    failData("{}: format: PRISM has voxels of u8 or u16, not of {}", name, voxelTypeName(job.type()));
  }
  if (job.channels.size() != 1) {
    failData("{}: channels: PRISM has one, not {}; choose it", name, job.channels.size());
  }
}

// It has places, names and values in data units.
void noteNanoVdbLosses(const ExportJob& job, ExportReport& report) {
  const Metadata& metadata = job.file.info().metadata;
  bool units = !metadata.length_unit.empty() || !metadata.space.empty();
  for (std::size_t i = 0; i < job.channels.size(); ++i) {
    const ChannelInfo& channel = job.channel(i);
    units = units || !channel.unit.empty();
    if (job.is_signed || (channel.value_scale == 1 && channel.value_offset == 0)) continue;
    report.notes.push_back(fmt::format("values of channel {} are in data units, {} + {} * stored, as 32-bit floats",
                                       job.channels[i], channel.value_offset, channel.value_scale));
  }
  if (units) report.notes.emplace_back("units are not kept");
}

// What raw and PRISM cannot say, and NRRD can.
void noteLosses(const ExportJob& job, const ExportOptions& options, ExportReport& report) {
  if (options.format == ExportFormat::nrrd) return;
  if (options.format == ExportFormat::nanovdb) return noteNanoVdbLosses(job, report);
  glm::dmat4 spacing(1.0);
  for (int i = 0; i < 3; ++i) spacing[i][i] = job.world_from_index[i][i];
  const bool is_plain = spacing == job.world_from_index && spacing[0][0] > 0 && spacing[1][1] > 0 && spacing[2][2] > 0;
  if (!is_plain) report.notes.emplace_back("of the place in the world only the size of a voxel is kept");
  const Metadata& metadata = job.file.info().metadata;
  bool names = !metadata.length_unit.empty() || !metadata.space.empty();
  for (std::size_t i = 0; i < job.channels.size(); ++i) {
    const ChannelInfo& channel = job.channel(i);
    names = names || !channel.unit.empty() || (job.channels.size() > 1 && !channel.name.empty());
    if (job.is_signed || (channel.value_scale == 1 && channel.value_offset == 0)) continue;
    report.notes.push_back(fmt::format("values of channel {} are stored ones: data = {} + {} * value", job.channels[i],
                                       channel.value_offset, channel.value_scale));
  }
  if (names) report.notes.emplace_back("units and names are not kept");
}

// As `import --type` spells it.
std::string writtenType(const ExportJob& job) {
  return job.is_signed ? fmt::format("i{}", 8 * voxelBytes(job.type())) : std::string(voxelTypeName(job.type()));
}

std::string rawFlags(const ExportJob& job) {
  const glm::ivec3 dims = job.box.dims();
  const auto side = [&](int i) { return glm::length(glm::dvec3(job.world_from_index[i])); };
  std::string flags = fmt::format("--dims {}x{}x{} --type {} --spacing {},{},{}", dims.x, dims.y, dims.z,
                                  writtenType(job), side(0), side(1), side(2));
  if (job.channels.size() > 1) flags += fmt::format(" --channels {} --planar", job.channels.size());
  return flags;
}

// No file says what is empty, and import would choose by the values that it sees. In data units as the file has them.
std::string emptyFlags(const ExportJob& job, bool maps_values) {
  std::string flags;
  for (std::size_t i = 0; i < job.channels.size(); ++i) {
    const ChannelInfo& channel = job.channel(i);
    const double stored = static_cast<double>(channel.empty_threshold);
    flags += fmt::format("{}{}", i == 0 ? " --empty " : ",", maps_values ? channel.dataFromStored(stored) : stored);
  }
  return flags;
}

std::string importFlags(const ExportJob& job, const ExportOptions& options) {
  std::string flags = options.format == ExportFormat::raw ? rawFlags(job) : "";
  const bool maps_values = options.format == ExportFormat::nrrd || options.format == ExportFormat::nanovdb;
  flags += emptyFlags(job, maps_values || job.is_signed);
  const ChannelValues values = job.channel(0).values;
  bool alike = job.type() != VoxelType::rgba8;
  for (std::size_t i = 0; i < job.channels.size(); ++i) alike = alike && job.channel(i).values == values;
  if (alike) flags += values == ChannelValues::labels ? " --values labels" : " --values intensity";
  return flags.starts_with(' ') ? flags.substr(1) : flags;
}

}  // namespace

ExportReport exportVolume(const VolumeFile& file, const std::filesystem::path& path, const ExportOptions& options) {
  const VolumeInfo& info = file.info();
  const std::string name = file.path().filename().string();
  if (!info.has(options.level, Form::values)) {
    failData("{}: level: {} is outside 0..{}", name, options.level, info.levels.size() - 1);
  }
  std::error_code absent;
  if (std::filesystem::is_directory(path, absent)) failData("{}: is a folder; none is replaced", path.string());
  if (std::filesystem::exists(path, absent) && !std::filesystem::is_regular_file(path, absent)) {
    failData("{}: is no regular file, and not replaced", path.string());
  }
  const VoxelBox box = checkedBox(options, info.level(options.level, Form::values).dims, name);
  ExportJob job{.file = file,
                .level = options.level,
                .box = box,
                .channels = checkedChannels(options, info, name),
                .world_from_index = boxPlace(info, options.level, box),
                .progress = options.progress};
  job.is_signed = options.format != ExportFormat::prism && isSigned(job);
  ExportReport report{.dims = box.dims(), .channels = job.channels.size(), .type = writtenType(job)};
  switch (options.format) {
    case ExportFormat::nrrd:
      report.bytes = writeNrrd(job, path);
      break;
    case ExportFormat::raw:
      report.bytes = writeRaw(job, path);
      break;
    case ExportFormat::prism:
      checkPrism(job, name);
      report.bytes = writePrism(job, path);
      break;
    case ExportFormat::nanovdb:
      report.bytes = writeNanoVdb(job, path);
      if (job.type() != VoxelType::rgba8) report.type = "f32";
      break;
  }
  report.import_flags = importFlags(job, options);
  noteLosses(job, options, report);
  return report;
}

}  // namespace blockwalk
