// SPDX-License-Identifier: Apache-2.0
#include "volume/export/export_job.h"

#include <algorithm>

#include "volume/error.h"

namespace blockwalk {

bool ExportJob::hasOneMap() const {
  for (std::size_t i = 1; i < channels.size(); ++i) {
    if (channel(i).value_scale != channel(0).value_scale || channel(i).value_offset != channel(0).value_offset) {
      return false;
    }
  }
  return true;
}

bool ExportJob::isLabels() const {
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (channel(i).values != ChannelValues::labels) return false;
  }
  return type() != VoxelType::rgba8;
}

glm::dvec3 ExportJob::spacing() const {
  const auto side = [&](int i) { return glm::length(glm::dvec3(world_from_index[i])); };
  return {side(0), side(1), side(2)};
}

bool ExportJob::isAligned() const {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (i == j ? !(world_from_index[i][j] > 0) : world_from_index[i][j] != 0) return false;
    }
  }
  return true;
}

std::string writtenType(const ExportJob& job) {
  return job.is_signed ? fmt::format("i{}", 8 * voxelBytes(job.type())) : std::string(voxelTypeName(job.type()));
}

void flipSigns(std::span<std::byte> voxels, std::size_t voxel_bytes) {
  for (std::size_t i = voxel_bytes - 1; i < voxels.size(); i += voxel_bytes) voxels[i] ^= std::byte{0x80};
}

void noteSpacingAlone(const ExportJob& job, std::vector<std::string>& notes) {
  if (job.isAligned() && job.world_from_index[3] == glm::dvec4(0, 0, 0, 1)) return;
  notes.emplace_back("of the place in the world only the size of a voxel is kept");
}

void noteStoredValues(const ExportJob& job, std::vector<std::string>& notes) {
  for (std::size_t i = 0; i < job.channels.size(); ++i) {
    const ChannelInfo& channel = job.channel(i);
    if (job.is_signed || (channel.value_scale == 1 && channel.value_offset == 0)) continue;
    notes.push_back(fmt::format("values of channel {} are stored ones: data = {} + {} * value", job.channels[i],
                                channel.value_offset, channel.value_scale));
  }
}

void noteNames(const ExportJob& job, std::vector<std::string>& notes) {
  const Metadata& metadata = job.file.info().metadata;
  bool has_names = !metadata.length_unit.empty() || !metadata.space.empty();
  for (std::size_t i = 0; i < job.channels.size(); ++i) {
    const ChannelInfo& channel = job.channel(i);
    has_names = has_names || !channel.unit.empty() || channel.color || channel.window || !channel.labels.empty() ||
                (job.channels.size() > 1 && !channel.name.empty());
  }
  if (has_names) notes.emplace_back("units, names and colours are not kept");
}

void noteChannelNames(const ExportJob& job, std::vector<std::string>& notes) {
  bool has_names = false;
  for (std::size_t i = 0; i < job.channels.size(); ++i) {
    const ChannelInfo& channel = job.channel(i);
    has_names = has_names || channel.color || channel.window || !channel.labels.empty() ||
                (job.channels.size() > 1 && !channel.name.empty());
  }
  if (has_names) notes.emplace_back("names, colours and windows of channels and labels are not kept");
}

void noteValueUnits(const ExportJob& job, std::vector<std::string>& notes) {
  bool has_units = false;
  for (std::size_t i = 0; i < job.channels.size(); ++i) has_units = has_units || !job.channel(i).unit.empty();
  if (has_units) notes.emplace_back("units of values are not kept");
}

void noteSpace(const ExportJob& job, std::vector<std::string>& notes) {
  if (!job.file.info().metadata.space.empty()) notes.emplace_back("what the axes of the world are is not kept");
}

void requireOneChannel(const ExportJob& job, std::string_view format) {
  if (job.channels.size() == 1) return;
  failData("{}: channels: {} has one, not {}; choose it", job.file.path().filename().string(), format,
           job.channels.size());
}

void requireTypes(const ExportJob& job, std::string_view format, std::span<const VoxelType> types) {
  if (std::ranges::find(types, job.type()) != types.end()) return;
  std::string names;
  for (std::size_t i = 0; i < types.size(); ++i) {
    names += fmt::format("{}{}", i == 0 ? "" : i + 1 == types.size() ? " or " : ", ", voxelTypeName(types[i]));
  }
  failData("{}: format: {} has voxels of {}, not of {}", job.file.path().filename().string(), format, names,
           voxelTypeName(job.type()));
}

}  // namespace blockwalk
