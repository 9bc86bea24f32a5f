// SPDX-License-Identifier: Apache-2.0
#include "volume/slice/slice_bytes.h"

#include <cmath>
#include <cstring>
#include <span>

#include "volume/export/export_job.h"

namespace blockwalk {
namespace {

// The slice as a box of a level, one voxel deep.
ExportJob sliceJob(const VolumeFile& file, const SlicePlan& plan, ExportFormat format) {
  ExportJob job = makeExportJob(file, {.format = format, .channels = plan.channels});
  const int axis = plan.axis < 0 ? 2 : plan.axis;
  const int column_axis = axis == 0 ? 1 : 0;
  const int row_axis = axis == 2 ? 1 : 2;
  glm::ivec3 dims(1);
  dims[column_axis] = plan.width;
  dims[row_axis] = plan.height;
  job.level = plan.level;
  job.box = {.begin = glm::ivec3(0), .end = dims};
  job.world_from_index[column_axis] = glm::dvec4(plan.right, 0);
  job.world_from_index[row_axis] = glm::dvec4(plan.down, 0);
  // A plane alone is as thick as a pixel of it is wide: no voxel is flat.
  const bool is_flat = plan.through == glm::dvec3(0);
  job.world_from_index[axis] =
      glm::dvec4(is_flat ? glm::cross(glm::normalize(plan.right), glm::normalize(plan.down)) * glm::length(plan.right)
                         : plan.through,
                 0);
  glm::dvec3 corner = plan.corner;
  if (is_flat) corner -= 0.5 * glm::dvec3(job.world_from_index[axis]);
  job.world_from_index[3] = glm::dvec4(corner, 1);
  return job;
}

template <typename T>
void appendRounded(std::vector<std::byte>& bytes, const std::vector<float>& values, bool is_signed) {
  const T outside = is_signed ? static_cast<T>(T{1} << (8 * sizeof(T) - 1)) : T{0};
  for (const float value : values) {
    const T whole = std::isnan(value) ? outside : static_cast<T>(std::lround(value));
    const auto* begin = reinterpret_cast<const std::byte*>(&whole);
    bytes.insert(bytes.end(), begin, begin + sizeof whole);
  }
}

template <typename T>
void appendBytes(std::vector<std::byte>& bytes, const std::vector<T>& values) {
  const auto raw = std::as_bytes(std::span(values));
  bytes.insert(bytes.end(), raw.begin(), raw.end());
}

}  // namespace

std::vector<std::byte> sliceBytes(const VolumeFile& file, const SlicePlan& plan, const SlicePixels& pixels,
                                  ExportFormat format) {
  const ExportJob job = sliceJob(file, plan, format);
  std::string header;
  if (format == ExportFormat::nrrd) header = nrrdHeader(job);
  if (format == ExportFormat::npy) header = npyHeader(job, plan.height, plan.width);
  const VoxelType type = job.type();
  const auto begin = std::as_bytes(std::span(header));
  std::vector<std::byte> bytes;
  bytes.reserve(header.size() + plan.pixels() * plan.channels.size() * voxelBytes(type));
  bytes.assign(begin.begin(), begin.end());
  if (type == VoxelType::rgba8) appendBytes(bytes, pixels.colors);
  for (const std::vector<float>& values : pixels.values) {
    if (type == VoxelType::f32) appendBytes(bytes, values);
    if (type == VoxelType::u8) appendRounded<std::uint8_t>(bytes, values, job.is_signed);
    if (type == VoxelType::u16) appendRounded<std::uint16_t>(bytes, values, job.is_signed);
  }
  if (job.is_signed) flipSigns(std::span(bytes).subspan(header.size()), voxelBytes(type));
  return bytes;
}

std::string sliceType(const VolumeFile& file, const SlicePlan& plan) {
  return writtenType(sliceJob(file, plan, ExportFormat::raw));
}

}  // namespace blockwalk
