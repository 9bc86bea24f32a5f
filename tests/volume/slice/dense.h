// SPDX-License-Identifier: Apache-2.0
// Volumes with everything in them, as dense arrays too, by which slices are judged.
#pragma once

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <functional>
#include <vector>

#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"
#include "volume/export/box_reader.h"
#include "volume/slice/slice_reader.h"

namespace blockwalk::volume_test {

constexpr glm::ivec3 kSliceDims{101, 67, 53};  // blocks have 48 voxels a side

// Every voxel of a level, one channel.
struct Dense {
  glm::ivec3 dims{0};
  VoxelType type = VoxelType::u8;
  std::vector<std::byte> bytes;

  const std::byte* at(glm::ivec3 p) const {
    const auto index =
        (static_cast<std::size_t>(p.z) * static_cast<std::size_t>(dims.y) + static_cast<std::size_t>(p.y)) *
            static_cast<std::size_t>(dims.x) +
        static_cast<std::size_t>(p.x);
    return bytes.data() + index * voxelBytes(type);
  }
  float density(glm::ivec3 p) const { return storedDensity(type, at(p)); }
  std::uint32_t color(glm::ivec3 p) const {
    std::uint32_t rgba = 0;
    std::memcpy(&rgba, at(p), sizeof rgba);
    return rgba;
  }
};

inline Dense denseLevel(const VolumeFile& file, int level, int channel) {
  Dense dense{.dims = file.info().levels[static_cast<std::size_t>(level)].dims, .type = file.info().type, .bytes = {}};
  dense.bytes.resize(cellCount(dense.dims) * voxelBytes(dense.type));
  BoxReader(file, level).read(channel, {.begin = glm::ivec3(0), .end = dense.dims}, dense.bytes);
  return dense;
}

inline SlicePixels readSlice(const VolumeFile& file, const SlicePlan& plan) {
  const auto reader = makeSliceReader(file, plan);
  while (reader->step()) continue;
  return reader->take();
}

inline SlicePixels readSlice(const VolumeFile& file, const SliceCut& cut) {
  return readSlice(file, planSlice(file.info(), cut));
}

// The pixel's voxel of a picture along an axis: columns and rows are the two other axes, ascending.
inline glm::ivec3 voxelOf(int axis, int column, int row, int depth) {
  if (axis == 0) return {depth, column, row};
  if (axis == 1) return {column, depth, row};
  return {column, row, depth};
}

inline bool sameBits(float a, float b) { return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b); }

class SliceVolumes : public testing::Test {
 protected:
  VolumeFile build(VoxelType type, std::size_t channels = 1, ValuesRule values = ValuesRule::intensity,
                   bool negative = false) {
    MemorySource source = randomSource(type, kSliceDims, 11, negative, channels);
    source.change().world_from_index = glm::dmat4(glm::dvec4(0.5, 0, 0, 0), glm::dvec4(0, 0.5, 0, 0),
                                                  glm::dvec4(0, 0, 0.5, 0), glm::dvec4(-3, 8, 16.25, 1));
    buildVolume(source, folder_ / "v.bwv", {.subblock_side = 8, .values = values});
    return VolumeFile(folder_ / "v.bwv");
  }

  ScratchFolder folder_{};
};

}  // namespace blockwalk::volume_test
