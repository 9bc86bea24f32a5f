// SPDX-License-Identifier: Apache-2.0
#include "volume/import/chunk_lattice.h"

#include <algorithm>

#include "volume/volume.h"

namespace blockwalk {

ChunkLattice::ChunkLattice(const ArrayPart& part, const std::vector<std::uint64_t>& cell) : cell_(cell) {
  for (int i = 0; i < 3; ++i) {
    const auto axis = part.space[static_cast<std::size_t>(i)];
    // A cell may be larger than the array.
    if (axis) cell_dims_[i] = static_cast<int>(std::min<std::uint64_t>(cell[*axis], kMaxDim));
  }
  dims_ = (part.dims + cell_dims_ - 1) / cell_dims_;
  if (part.channel) cell_channels_ = cell[*part.channel];
  channel_cells_ = (part.channels + cell_channels_ - 1) / cell_channels_;
}

std::uint64_t ChunkLattice::number(std::size_t channel_cell, glm::ivec3 cell) const {
  std::uint64_t number = channel_cell;
  for (int i = 2; i >= 0; --i)
    number = number * static_cast<std::uint64_t>(dims_[i]) + static_cast<std::uint64_t>(cell[i]);
  return number;
}

glm::ivec3 ChunkLattice::cellOf(std::uint64_t number) const {
  glm::ivec3 cell{0};
  for (int i = 0; i < 3; ++i) {
    cell[i] = static_cast<int>(number % static_cast<std::uint64_t>(dims_[i]));
    number /= static_cast<std::uint64_t>(dims_[i]);
  }
  return cell;
}

std::vector<std::uint64_t> ChunkLattice::numbers(const ArrayPart& part, std::size_t channel_cell,
                                                 glm::ivec3 cell) const {
  std::vector<std::uint64_t> numbers(cell_.size());
  for (std::size_t axis = 0; axis < cell_.size(); ++axis) numbers[axis] = part.index[axis] / cell_[axis];
  for (int i = 0; i < 3; ++i) {
    const auto axis = part.space[static_cast<std::size_t>(i)];
    if (axis) numbers[*axis] = static_cast<std::uint64_t>(cell[i]);
  }
  if (part.channel) numbers[*part.channel] = channel_cell;
  return numbers;
}

VoxelBox ChunkLattice::cellsOf(const VoxelBox& box) const {
  return {.begin = box.begin / cell_dims_, .end = (box.end + cell_dims_ - 1) / cell_dims_};
}

// Goes from each cell to the next that can lie in the box.
bool anyCell(const std::vector<std::uint64_t>& present, const ChunkLattice& lattice, std::size_t channel_cell,
             const VoxelBox& cells) {
  auto at = std::ranges::lower_bound(present, lattice.number(channel_cell, cells.begin));
  const std::uint64_t last = lattice.number(channel_cell, cells.end - 1);
  while (at != present.end() && *at <= last) {
    glm::ivec3 cell = lattice.cellOf(*at);
    if (cell.x >= cells.end.x) cell = {cells.begin.x, cell.y + 1, cell.z};
    if (cell.y >= cells.end.y) cell = {cells.begin.x, cells.begin.y, cell.z + 1};
    if (cell.y < cells.begin.y) cell = {cells.begin.x, cells.begin.y, cell.z};
    cell.x = std::max(cell.x, cells.begin.x);
    const std::uint64_t next = lattice.number(channel_cell, cell);
    if (next == *at) return true;
    at = std::lower_bound(at, present.end(), next);
  }
  return false;
}

}  // namespace blockwalk
