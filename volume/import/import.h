// SPDX-License-Identifier: Apache-2.0
// Opens image files as a Source. The format is found from the content, never from the name alone.
#pragma once

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "volume/source.h"

namespace blockwalk {

enum class DensityRule { automatic, alpha, luminance, max };

// What several samples a voxel are: a colour, or a channel each. automatic: colour where the file says so, or where it
// says nothing and three or four u8 or u16 usually are one. separate: each source is a channel.
enum class ChannelRule { automatic, color, fields, separate };

// The flags of `blockwalk import`. What a self-describing file says itself may be overridden by spacing only.
struct ImportOptions {
  std::optional<glm::ivec3> dims;   // raw: required. PNG: the slices are tiles of one image, row-major.
  std::optional<std::string> type;  // raw: u8 i8 u16 i16 u32 i32 f32 f64 rgb8 rgba8
  std::optional<glm::dvec3> spacing;
  int raw_channels = 1;                          // raw: values a voxel, a channel each
  bool planar = false;                           // raw: channel after channel, not voxel after voxel
  bool big_endian = false;                       // raw
  std::uint64_t skip_bytes = 0;                  // raw: bytes before the first voxel
  DensityRule density = DensityRule::automatic;  // alpha where there is one, else max
  ChannelRule channels = ChannelRule::automatic;
  std::optional<std::int64_t> frame;       // of a file with several volumes, counted from 0
  std::optional<std::int64_t> time;        // the same, of steps in time; the first where neither is given
  std::optional<std::string> series;       // DICOM: which of several, by its number in the list of them or its UID
  std::vector<std::string> channel_names;  // none, or one a channel
  std::optional<int> level;                // OME-Zarr, HDF5, TIFF: 0 is the finest
  std::optional<std::string> dataset;      // of a file with several: by its path or name
  // Taken off every sample that 32-bit floats may not hold exactly, before it becomes one (value_offset.h).
  std::optional<double> value_offset;
  std::uint64_t memory_bytes = std::uint64_t{2} << 30;
  // Where it is said how many volumes there are one after the other, of which frame or time choose one; 0: the format
  // has no such thing.
  std::shared_ptr<std::int64_t> step_count = nullptr;

  bool choosesStep() const { return frame.has_value() || time.has_value(); }
  // Of several sources that are a channel each, the least.
  void tellSteps(std::int64_t count) const {
    if (step_count != nullptr) *step_count = *step_count == 0 ? count : std::min(*step_count, count);
  }
};

// One file, or the slices of a stack in any order (they are sorted naturally: slice2 before slice10), or one folder of
// slices or of PRISM's bricks. Where each source is a channel, each of the paths is one of these. Throws DataError.
std::unique_ptr<Source> openSource(const std::vector<std::filesystem::path>& paths, const ImportOptions& options);

}  // namespace blockwalk
