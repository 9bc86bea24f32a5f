// SPDX-License-Identifier: Apache-2.0
// Voxels alone, and those of NumPy (numpy.org/neps/nep-0001-npy-format.html), which are voxels behind their shape.
#include <string>

#include "volume/error.h"
#include "volume/export/export_job.h"
#include "volume/export/planes.h"

namespace blockwalk {
namespace {

Written writeVoxels(const ExportJob& job, const std::string& header, const std::filesystem::path& path) {
  const glm::ivec3 dims = job.box.dims();
  const glm::dvec3 spacing = job.spacing();
  Written written{.bytes = writePlanes(job, {.header = header}, path)};
  written.flags = fmt::format("--spacing {},{},{}", spacing.x, spacing.y, spacing.z);
  if (header.empty()) {
    written.flags += fmt::format(" --dims {}x{}x{} --type {}", dims.x, dims.y, dims.z, writtenType(job));
    if (job.channels.size() > 1) written.flags += fmt::format(" --channels {} --planar", job.channels.size());
  }
  noteSpacingAlone(job, written.notes);
  noteStoredValues(job, written.notes);
  noteNames(job, written.notes);
  return written;
}

std::string numpyType(const ExportJob& job) {
  switch (job.type()) {
    case VoxelType::u8:
      return job.is_signed ? "|i1" : "|u1";
    case VoxelType::u16:
      return job.is_signed ? "<i2" : "<u2";
    case VoxelType::f32:
      return "<f4";
    case VoxelType::rgba8:
      return "|u1";
  }
  return "";
}

// `shape` of one channel.
std::string headerOf(const ExportJob& job, std::string shape) {
  if (job.channels.size() > 1) shape = fmt::format("{}, {}", job.channels.size(), shape);
  if (job.type() == VoxelType::rgba8) shape += ", 4";
  std::string text = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}", numpyType(job), shape);
  constexpr std::size_t kAlignment = 64;
  constexpr std::size_t kPrefix = 10;  // magic, version, length of the text
  while ((kPrefix + text.size() + 1) % kAlignment != 0) text += ' ';
  text += '\n';
  std::string header("\x93NUMPY\x01\0", 8);
  header += static_cast<char>(text.size() & 0xff);
  header += static_cast<char>(text.size() >> 8);
  return header + text;
}

}  // namespace

// Of axes z, y, x; several channels in front of them, the four of a colour behind.
std::string npyHeader(const ExportJob& job) {
  const glm::ivec3 dims = job.box.dims();
  return headerOf(job, fmt::format("{}, {}, {}", dims.z, dims.y, dims.x));
}

std::string npyHeader(const ExportJob& job, int rows, int columns) {
  return headerOf(job, fmt::format("{}, {}", rows, columns));
}

Written writeRaw(const ExportJob& job, const std::filesystem::path& path) { return writeVoxels(job, {}, path); }

Written writeNpy(const ExportJob& job, const std::filesystem::path& path) {
  return writeVoxels(job, npyHeader(job), path);
}

}  // namespace blockwalk
