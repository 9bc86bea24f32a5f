// SPDX-License-Identifier: Apache-2.0
// One level of one channel of a volume as a plain dense array: what the reference renderer looks at. A voxel that is
// not stored has the density NaN, which is empty by definition.
#pragma once

#include <array>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "volume/file/file.h"
#include "volume/source.h"
#include "volume/voxel.h"

namespace blockwalk::reference {

// Density of a block's non-empty voxels in stored units. Not stored: no voxel of the block is non-empty, in any
// channel; stored for another channel's sake alone: no bins.
struct BlockRange {
  bool stored = false;
  float density_min = 0;
  float density_max = 0;
  std::uint8_t bins = 0;  // bit b: a voxel of range-mask bin b is inside
  bool operator==(const BlockRange&) const = default;
};

struct Extent {
  double min = 0;
  double max = 0;
};

struct DenseVolume {
  VoxelType type = VoxelType::u8;
  std::size_t channel = 0;  // of its volume: which of a view's channels is meant
  glm::ivec3 level0_dims{0};
  int level = 0;
  glm::ivec3 dims{0};                // of this level
  glm::dmat4 world_from_index{1.0};  // of level 0
  double value_scale = 1;
  double value_offset = 0;
  float empty_threshold = 0;  // stored units
  // Densities of level 0's non-empty voxels, data units. A coarser level may leave them: it averages with empty voxels.
  std::optional<Extent> level0_extent{};
  double contrast =
      1;  // stored units: what 99.8 % of level 0 are at most, less the empty value; what light's strength goes by
  std::vector<float> density{};                      // stored units, x fastest
  std::vector<std::array<std::uint8_t, 3>> color{};  // rgba8 only
  std::array<float, 7> bin_cuts{};                   // interior cuts of the range-mask bins, stored units
  int subblock_side = 8;                             // voxels
  int block_voxels = 48;
  glm::ivec3 block_dims{0};  // blocks an axis
  std::vector<BlockRange> blocks{};

  std::size_t at(glm::ivec3 voxel) const;
  std::size_t blockAt(glm::ivec3 block) const;
  int binOf(float stored) const;  // how many cuts are at or below a density
  double dataAt(std::size_t voxel) const { return value_offset + value_scale * static_cast<double>(density[voxel]); }
};

// A volume of level 0 whose voxels are all absent and whose index space is world space.
DenseVolume emptyVolume(VoxelType type, glm::ivec3 dims);

// Derives the blocks from the voxels: those with a non-empty voxel are stored.
void deriveBlocks(DenseVolume& volume, int block_voxels);

// Level 0 as the source yields it, every voxel present. The threshold is in stored units.
DenseVolume volumeFromSource(Source& source, float empty_threshold, int block_voxels);

// One level of a channel as the file stores it; blocks and their ranges are the file's records.
DenseVolume volumeFromFile(const VolumeFile& file, int level, std::size_t number = 0, Form form = Form::values);

}  // namespace blockwalk::reference
