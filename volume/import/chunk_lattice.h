// SPDX-License-Identifier: Apache-2.0
// The part of an array that a volume is made of, and the cells that the array is cut into.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "volume/voxel_box.h"

namespace blockwalk {

// What the axes of an array are to a volume.
struct ArrayPart {
  std::array<std::optional<std::size_t>, 3> space;  // x, y, z
  std::optional<std::size_t> channel;
  std::vector<std::uint64_t> index;  // by axis, of those that are none of these
  glm::ivec3 dims{1};
  std::size_t channels = 1;
};

// Cells of a lattice over the part, of so many samples by axis, with numbers that ascend along x, y, z and channels.
class ChunkLattice {
 public:
  ChunkLattice(const ArrayPart& part, const std::vector<std::uint64_t>& cell);

  glm::ivec3 cellDims() const { return cell_dims_; }
  glm::ivec3 dims() const { return dims_; }
  std::size_t channelCells() const { return channel_cells_; }
  std::size_t channelCell(std::size_t channel) const { return channel / cell_channels_; }
  std::uint64_t number(std::size_t channel_cell, glm::ivec3 cell) const;
  glm::ivec3 cellOf(std::uint64_t number) const;
  // By axis of the array.
  std::vector<std::uint64_t> numbers(const ArrayPart& part, std::size_t channel_cell, glm::ivec3 cell) const;
  // The cells that a box of voxels touches.
  VoxelBox cellsOf(const VoxelBox& box) const;

 private:
  std::vector<std::uint64_t> cell_;
  glm::ivec3 cell_dims_{1};
  glm::ivec3 dims_{1};
  std::size_t cell_channels_ = 1;
  std::size_t channel_cells_ = 1;
};

// Whether any of these cells is among `present`, the ascending numbers of a lattice's cells.
bool anyCell(const std::vector<std::uint64_t>& present, const ChunkLattice& lattice, std::size_t channel_cell,
             const VoxelBox& cells);

}  // namespace blockwalk
