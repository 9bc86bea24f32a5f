// SPDX-License-Identifier: Apache-2.0
// The one interface between importers and the builder: a source yields rows of voxels in the stored type.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <string>

#include "volume/voxel.h"

namespace blockwalk {

struct SourceInfo {
  std::string name;    // for people and messages: file name without folders
  std::string format;  // "raw", "nrrd", "metaimage", "png", "tiff", "demo"
  VoxelType type = VoxelType::u8;
  glm::ivec3 dims{0};
  glm::dmat4 world_from_index{1.0};
  double value_scale = 1;
  double value_offset = 0;
  bool random_access = false;  // rows may be asked for in any order
};

// What conversion to the stored type did, up to the rows read so far.
struct ConversionReport {
  std::uint64_t nonfinite_voxels = 0;
  double largest_rounding = 0;  // data units
};

class Source {
 public:
  virtual ~Source() = default;
  virtual const SourceInfo& info() const = 0;
  // Rows [y, y + count) of slice z, converted: count * dims.x * voxelBytes(type) bytes, x fastest.
  // Without random access the calls must come in ascending (z, y) without gaps. Throws DataError.
  virtual void readRows(int z, int y, int count, std::span<std::byte> out) = 0;
  virtual ConversionReport conversion() const { return {}; }
};

}  // namespace blockwalk
