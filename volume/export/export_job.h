// SPDX-License-Identifier: Apache-2.0
// What every writer is given: choices that are made and checked.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string_view>
#include <vector>

#include "volume/file/file.h"
#include "volume/voxel_box.h"

namespace blockwalk {

struct ExportJob {
  const VolumeFile& file;
  int level = 0;
  VoxelBox box;               // not empty, inside the level
  std::vector<int> channels;  // at least one, no repeats
  // Of the box: its first voxel covers [0,1)^3.
  glm::dmat4 world_from_index{1.0};
  // The values are those of a signed type, which import moved up by half its range, and the format has such types.
  bool is_signed = false;
  std::function<void(std::string_view, std::uint64_t, std::uint64_t)> progress = nullptr;

  VoxelType type() const { return file.info().type; }
  const ChannelInfo& channel(std::size_t i) const {
    return file.info().channels[static_cast<std::size_t>(channels[i])];
  }
};

// One function a format. Each writes `path` whole or not at all and returns the bytes written.
std::uint64_t writeNrrd(const ExportJob& job, const std::filesystem::path& path);
std::uint64_t writeRaw(const ExportJob& job, const std::filesystem::path& path);
std::uint64_t writeNanoVdb(const ExportJob& job, const std::filesystem::path& path);
std::uint64_t writePrism(const ExportJob& job, const std::filesystem::path& path);

}  // namespace blockwalk
