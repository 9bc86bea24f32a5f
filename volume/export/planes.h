// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "volume/export/export_job.h"

namespace blockwalk {

// Bytes of the job's voxels, dense.
std::uint64_t planesBytes(const ExportJob& job);

// Which of the slices of several channels come first: all of one channel's, or all of one place's.
enum class PlaneOrder { by_channel, by_slice };

struct PlaneFile {
  std::string header = {};
  PlaneOrder order = PlaneOrder::by_channel;
  std::string trailer = {};
};

// A file of the header, then the voxels, x fastest, little endian, then the trailer. Returns its bytes.
std::uint64_t writePlanes(const ExportJob& job, const PlaneFile& plan, const std::filesystem::path& path);

}  // namespace blockwalk
