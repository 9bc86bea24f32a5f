// SPDX-License-Identifier: Apache-2.0
// The one interface between importers and the builder: a source yields rows of voxels in the stored type.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "volume/error.h"
#include "volume/volume.h"
#include "volume/voxel.h"
#include "volume/voxel_box.h"

namespace blockwalk {

// Part of a row: x from `begin` up to and without `end`.
struct VoxelRun {
  int begin = 0;
  int end = 0;
  bool operator==(const VoxelRun&) const = default;
};

// The same voxels in runs that are ascending and apart.
inline void mergeRuns(std::vector<VoxelRun>& runs) {
  std::ranges::sort(runs, {}, &VoxelRun::begin);
  std::size_t last = 0;
  for (const VoxelRun& run : runs) {
    if (run.begin <= runs[last].end) {
      runs[last].end = std::max(runs[last].end, run.end);
    } else {
      runs[++last] = run;
    }
  }
  if (!runs.empty()) runs.resize(last + 1);
}

// One scalar field of a source.
struct SourceChannel {
  std::string name;  // for people, at most 64 bytes; empty where the source has none, and where there is one channel
  double value_scale = 1;
  double value_offset = 0;
  std::string unit = {};                                            // of data values, where the source says it
  std::optional<std::array<std::uint8_t, 3>> color = std::nullopt;  // to show it in, where the source says one
  std::optional<std::array<double, 2>> window = std::nullopt;  // what to show first: least and greatest, data units
  bool is_labels = false;                                      // the source says that the values are labels
  std::vector<LabelInfo> labels = {};                          // of a channel of labels, ascending
};

struct SourceInfo {
  std::string name;    // for people and messages: file name without folders
  std::string format;  // "raw", "nrrd", "metaimage", "nifti", "dicom", "png", "tiff", "pictures", "prism", "idx",
                       // "zarr", "hdf5", "vdb", "nanovdb", "npy", "mrc", "vox", "kvx", "pvm", "amira", "vgi", "esrf",
                       // "isq", "aim", "demo"
  VoxelType type = VoxelType::u8;
  glm::ivec3 dims{0};
  glm::dmat4 world_from_index{1.0};
  std::string length_unit = {};  // of world space; empty where the source does not say it
  std::string space = {};        // what its axes are
  std::vector<SourceChannel> channels = std::vector<SourceChannel>(1);  // 1..kMaxChannels, all of `type`
  bool random_access = false;                                           // rows may be asked for in any order
  bool may_round = false;  // samples are of a type that 32-bit floats do not hold exactly
  std::vector<std::pair<std::string, std::string>> facts = {};  // for the file's metadata: key, and value for people
  std::vector<std::string> notes =
      {};  // for people who import it: what was guessed, missing or passed over; mostly none
  // Of a source that says where it is blank: the one voxel that it has there, channel after channel, in the stored
  // type. Such a source has random access and another() of itself.
  std::vector<std::byte> blank = {};
};

// Bytes of a row of voxels in one channel.
inline std::size_t channelRowBytes(const SourceInfo& info) {
  return static_cast<std::size_t>(info.dims.x) * voxelBytes(info.type);
}

// What conversion to the stored type did to one channel, up to the rows read so far.
struct ConversionReport {
  std::uint64_t nonfinite_voxels = 0;
  double largest_rounding = 0;  // data units

  // Of other rows.
  void add(const ConversionReport& other) {
    nonfinite_voxels += other.nonfinite_voxels;
    largest_rounding = std::max(largest_rounding, other.largest_rounding);
  }
};

class Source {
 public:
  virtual ~Source() = default;
  virtual const SourceInfo& info() const = 0;
  // Rows [y, y + count) of slice z, converted: channel after channel, of each count * channelRowBytes() bytes, x
  // fastest. Without random access the calls must come in ascending (z, y) without gaps. Throws DataError.
  virtual void readRows(int z, int y, int count, std::span<std::byte> out) = 0;
  // A source of the same rows for another thread, which has read none so far; nothing where there is but one reader.
  // Only of sources with random access. What both need outlives either.
  virtual std::unique_ptr<Source> another() const { return nullptr; }
  // Only of sources that say where they are blank, and fast there, however large the box: replaces `runs` by those of
  // x, ascending and apart, outside of which all voxels of the box are blank. They may say too much, never too little.
  virtual void findRuns(const VoxelBox& /*box*/, std::vector<VoxelRun>& /*runs*/) {
    BLOCKWALK_CHECK(info().blank.size(), ==, std::size_t{0});
  }
  // And the voxels of a box, converted: channel after channel, z, y, x fastest. Throws DataError.
  virtual void readBox(const VoxelBox& /*box*/, std::span<std::byte> /*out*/) {
    BLOCKWALK_CHECK(info().blank.size(), ==, std::size_t{0});
  }
  virtual ConversionReport conversion(std::size_t /*channel*/) const { return {}; }
};

}  // namespace blockwalk
