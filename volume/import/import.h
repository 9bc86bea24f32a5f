// SPDX-License-Identifier: Apache-2.0
// Opens image files as a Source. The format is found from the content, never from the name alone.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "volume/source.h"

namespace blockwalk {

enum class DensityRule { automatic, alpha, luminance, max };

// The flags of `blockwalk import`. What a self-describing file says itself may be overridden by spacing only.
struct ImportOptions {
  std::optional<glm::ivec3> dims;   // raw: required. PNG: the slices are tiles of one image, row-major.
  std::optional<std::string> type;  // raw: u8 i8 u16 i16 u32 i32 f32 f64 rgb8 rgba8
  std::optional<glm::dvec3> spacing;
  bool big_endian = false;                       // raw
  std::uint64_t skip_bytes = 0;                  // raw: bytes before the first voxel
  DensityRule density = DensityRule::automatic;  // alpha where there is one, else luminance
  std::uint64_t memory_bytes = std::uint64_t{2} << 30;
};

// One file, or the slices of a stack in any order (they are sorted naturally: slice2 before slice10), or one folder of
// slices. Throws DataError.
std::unique_ptr<Source> openSource(const std::vector<std::filesystem::path>& paths, const ImportOptions& options);

}  // namespace blockwalk
