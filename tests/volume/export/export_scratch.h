// SPDX-License-Identifier: Apache-2.0
// Volumes to export, and what importing the result gives.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "tests/volume/file/file_contents.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"
#include "volume/error.h"
#include "volume/export/export.h"
#include "volume/import/import.h"
#include "volume/import/source_facts.h"

namespace blockwalk::volume_test {

// The flags that the report names, as the command line reads them.
struct ImportFlags {
  ImportOptions source;
  BuildOptions build;
};

inline ImportFlags readFlags(const std::string& text) {
  ImportFlags flags;
  std::istringstream words(text);
  std::string word;
  const auto numbers = [&] {
    std::vector<double> result;
    std::string list;
    words >> list;
    std::istringstream items(list);
    for (std::string item; std::getline(items, item, list.find('x') == std::string::npos ? ',' : 'x');) {
      result.push_back(std::stod(item));
    }
    return result;
  };
  while (words >> word) {
    if (word == "--dims") {
      const auto dims = numbers();
      flags.source.dims = glm::ivec3(glm::dvec3(dims.at(0), dims.at(1), dims.at(2)));
    } else if (word == "--type") {
      flags.source.type.emplace();
      words >> *flags.source.type;
    } else if (word == "--spacing") {
      const auto spacing = numbers();
      flags.source.spacing = glm::dvec3(spacing.at(0), spacing.at(1), spacing.at(2));
    } else if (word == "--channels") {
      words >> word;
      if (word == "color") {
        flags.source.channels = ChannelRule::color;
      } else {
        flags.source.raw_channels = std::stoi(word);
      }
    } else if (word == "--planar") {
      flags.source.planar = true;
    } else if (word == "--empty") {
      flags.build.empty_thresholds = numbers();
    } else if (word == "--values") {
      words >> word;
      flags.build.values = word == "labels" ? ValuesRule::labels : ValuesRule::intensity;
    } else {
      ADD_FAILURE() << "a flag that is not known: " << word;
    }
  }
  return flags;
}

// Imports `path` with the flags of its report into `volume`.
inline void importAgain(const std::filesystem::path& path, const ExportReport& report,
                        const std::filesystem::path& volume, int subblock_side = 8) {
  ImportFlags flags = readFlags(report.import_flags);
  flags.build.subblock_side = subblock_side;
  flags.build.block_side = 3;
  buildVolume(*openSource({path}, flags.source), volume, flags.build);
}

// Of a volume that was imported again, what does not tell from which fields and files.
inline std::string importedContents(const std::filesystem::path& volume) {
  return readContents(volume, {kSpacingFromKey, kReadFromKey});
}

struct Shape {
  VoxelType type;
  std::size_t channels;
  glm::ivec3 dims;
  int subblock_side;
  double threshold;  // stored units
};

inline const Shape kShapes[] = {
    {VoxelType::u8, 1, {61, 47, 33}, 8, 0},     {VoxelType::u8, 4, {29, 53, 7}, 4, 100},
    {VoxelType::u16, 1, {1, 75, 50}, 16, 999},  {VoxelType::u16, 3, {50, 25, 26}, 8, 20000},
    {VoxelType::f32, 1, {40, 31, 59}, 8, -90},  {VoxelType::f32, 2, {97, 3, 13}, 4, 0.125},
    {VoxelType::rgba8, 1, {23, 64, 25}, 8, 99}, {VoxelType::rgba8, 1, {1, 1, 1}, 8, 0},
};

// Blocks are of 3 subblocks a side; data thresholds are the shape's.
inline void buildShape(const Shape& shape, MemorySource& source, const std::filesystem::path& volume) {
  BuildOptions options;
  options.subblock_side = shape.subblock_side;
  options.block_side = 3;
  for (const SourceChannel& channel : source.info().channels) {
    options.empty_thresholds.push_back(channel.value_offset + channel.value_scale * shape.threshold);
  }
  buildVolume(source, volume, options);
}

// 40,000 x 100 voxels a slice, 16 MB, and two of all are there.
struct LongSource final : Source {
  explicit LongSource(int slices) {
    info_.name = "sparse";
    info_.type = VoxelType::f32;
    info_.dims = {40000, 100, slices};
  }
  const SourceInfo& info() const override { return info_; }
  void readRows(int z, int y, int /*count*/, std::span<std::byte> out) override {
    std::ranges::fill(out, std::byte{0});
    const float one = 1;
    if (y == 0 && (z == 0 || z == 96)) std::memcpy(out.data(), &one, sizeof one);
  }
  SourceInfo info_;
};

inline std::set<std::string> namesIn(const std::filesystem::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

// The message of the DataError that exporting throws, or "no error".
inline std::string exportRefusal(const std::filesystem::path& volume, const std::filesystem::path& out,
                                 const ExportOptions& options) {
  try {
    exportVolume(VolumeFile(volume), out, options);
  } catch (const DataError& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace blockwalk::volume_test
