// SPDX-License-Identifier: Apache-2.0
// Reads all of a volume file: what is otherwise held against its checksum when somebody needs it.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "volume/file/file.h"

namespace blockwalk {

struct FileCheck {
  std::uint64_t pages = 0;        // that are right
  std::uint64_t voxel_bytes = 0;  // of these, unpacked
  std::uint64_t faults = 0;
  std::vector<std::string> reasons;  // of the first faults, kMostReasons at most
};
constexpr std::size_t kMostReasons = 20;

// Records and ranges, apron ranges and voxels of every level, form and channel. What is wrong is counted and said, and
// does not end it. One page in memory at a time, and a level's records. `progress`: pages done, of the whole file.
FileCheck checkFile(
    const VolumeFile& file,
    const std::function<void(std::string_view step, std::uint64_t done, std::uint64_t total)>& progress);

}  // namespace blockwalk
