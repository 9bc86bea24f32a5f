// SPDX-License-Identifier: Apache-2.0
// What every writer is given, choices that are made and checked, and what it says it did.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "volume/export/export.h"
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
  // All channels of the job have the map from stored values to data that the first has.
  bool hasOneMap() const;
  bool isLabels() const;  // all of them
  // Of a voxel of the box, along its axes.
  glm::dvec3 spacing() const;
  // The axes of the box are those of the world, none of them turned round.
  bool isAligned() const;
};

// Throws ExportError for options that the volume has not.
ExportJob makeExportJob(const VolumeFile& file, const ExportOptions& options);

// As `blockwalk import --type` spells the type of what is written.
std::string writtenType(const ExportJob& job);

// Between values of a signed type and the stored ones, which are moved up by half the range.
void flipSigns(std::span<std::byte> voxels, std::size_t voxel_bytes);

struct ValueMap {
  double scale = 1;
  double offset = 0;
};

struct Written {
  std::uint64_t bytes = 0;  // holes of files too
  std::string type = {};    // of what is written, where it is not writtenType()
  std::string flags = {};   // of import, to read the same voxels again; what is empty is not among them
  // From stored values to those that whoever reads it gets, of all channels; nothing: each channel's own.
  std::optional<ValueMap> map = ValueMap{};
  std::vector<std::string> notes = {};  // what the format has no place for
};

// One function a format. Each writes `path` whole or not at all.
using Writer = Written (*)(const ExportJob& job, const std::filesystem::path& path);
Written writeNrrd(const ExportJob& job, const std::filesystem::path& path);
Written writeRaw(const ExportJob& job, const std::filesystem::path& path);
Written writeNpy(const ExportJob& job, const std::filesystem::path& path);
Written writePrism(const ExportJob& job, const std::filesystem::path& path);
Written writeNifti(const ExportJob& job, const std::filesystem::path& path);
Written writeTiff(const ExportJob& job, const std::filesystem::path& path);
Written writePng(const ExportJob& job, const std::filesystem::path& path);
Written writeZarr(const ExportJob& job, const std::filesystem::path& path);
Written writeNanoVdb(const ExportJob& job, const std::filesystem::path& path);

// The first bytes of a file of which the rest are the voxels, channel after channel.
std::string nrrdHeader(const ExportJob& job);
std::string npyHeader(const ExportJob& job);
// The same of a picture of this many rows and columns: channels in front, the four of a colour behind.
std::string npyHeader(const ExportJob& job, int rows, int columns);

// Notes of what a format has no place for; none where there is nothing of it.
void noteSpacingAlone(const ExportJob& job, std::vector<std::string>& notes);
void noteStoredValues(const ExportJob& job, std::vector<std::string>& notes);
void noteNames(const ExportJob& job, std::vector<std::string>& notes);
void noteChannelNames(const ExportJob& job, std::vector<std::string>& notes);
void noteValueUnits(const ExportJob& job, std::vector<std::string>& notes);
void noteSpace(const ExportJob& job, std::vector<std::string>& notes);
// Refuses what the format has no place for, in data and not just in words.
void requireOneChannel(const ExportJob& job, std::string_view format);
void requireTypes(const ExportJob& job, std::string_view format, std::span<const VoxelType> types);

}  // namespace blockwalk
