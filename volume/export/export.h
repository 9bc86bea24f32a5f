// SPDX-License-Identifier: Apache-2.0
// Writes a box of a level of a volume for other programs: the way back of volume/import. Data flows so:
//
//   VolumeFile  blocks of a level, packed, empty ones not there
//       | BoxReader: a piece at a time, dense
//   planes.h (NRRD, raw, npy, NIfTI, TIFF: pieces at their places), row_reader.h (PNG, gzip: rows in their order),
//   prism.cpp (bricks in hierarchical Z order), zarr.cpp (chunks of every level) or nano_leaves.h
//   (leaves of a NanoVDB tree)
//       | OutputFile, OutputFolder: whole or not at all
//
// Voxels that are stored come out bit for bit, also those that are empty; the others, which are all empty, as the empty
// value of their channel (emptyValue(), the data value 0 where that is empty). Runs of zeros become holes of the file.
// NanoVDB alone says what is empty: there it is not active, and has that value too.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/file/file.h"
#include "volume/voxel_box.h"

namespace blockwalk {

enum class ExportFormat { nrrd, nifti, tiff, zarr, nanovdb, npy, raw, png, prism };

// By name: "nrrd". By how a file of it is named: "x.nii.gz", "x.TIF"; nothing where no format has such names.
std::optional<ExportFormat> exportFormat(std::string_view name);
std::optional<ExportFormat> exportFormatOf(const std::filesystem::path& path);
std::vector<std::string> exportFormatNames();
// ".nrrd .nii ...", for people.
std::string exportEndings();

struct ExportOptions {
  ExportFormat format = ExportFormat::nrrd;
  int level = 0;
  std::optional<VoxelBox> box = std::nullopt;  // voxels of the level; else all of it
  std::vector<int> channels = {};              // in the order that they are written; else all
  // Step name ("write"), work done and work in all; called often, from the calling thread.
  std::function<void(std::string_view step, std::uint64_t done, std::uint64_t total)> progress = nullptr;
};

// Options that the volume has not.
struct ExportError : DataError {
  ExportError(std::string option, const std::string& detail) : DataError(detail), field(std::move(option)) {}
  std::string field;  // "level", "box", "channels", "format"
};

struct ExportReport {
  glm::ivec3 dims{0};
  std::size_t channels = 1;
  std::string type = {};                // of a voxel, as `blockwalk import --type` spells it
  std::uint64_t bytes = 0;              // of all that was written, holes too
  std::string import_flags = {};        // with which `blockwalk import` makes the same voxels again
  std::vector<std::string> notes = {};  // what the format has no place for
};

// What of a volume the options mean: how many bytes its voxels are, dense. Throws ExportError, whose message begins
// with `name`.
std::uint64_t measureExport(const VolumeInfo& info, const ExportOptions& options, const std::string& name);

// Writes `path` under a temporary name and renames it when complete; what fails leaves nothing. A file that is there is
// replaced, a folder is not. Memory: the level's records, and some 64 MiB whatever the volume's size; for NanoVDB 1200
// bytes more for each cube of 128^3 voxels that holds something, of which there may be 2^20. Throws DataError
// for what the file or the options get wrong, std::system_error for the disk.
ExportReport exportVolume(const VolumeFile& file, const std::filesystem::path& path, const ExportOptions& options);

}  // namespace blockwalk
