// SPDX-License-Identifier: Apache-2.0
// The shell of a subblock: the range of densities in each of the 26 parts that a neighbour's apron takes from it, and
// in the whole of it.
#pragma once

#include <cstddef>
#include <span>

#include "volume/volume.h"

namespace blockwalk {

// Part dx + 3 dy + 9 dz of a subblock's shell, each d 0, 1 or 2 for -1, 0 and +1: the voxels that lie in the apron of
// the neighbour there. Part 13 is the whole subblock.
constexpr std::size_t kShellParts = 27;

// Takes the shell of one channel of a subblock.
class ShellReader {
 public:
  // Takes value map and threshold of the channel, which must be final. `side`: of a subblock, voxels.
  ShellReader(VoxelType type, int side, const ChannelInfo& channel);

  // Least and greatest density of each part, in the stored width, with the empty value for empty voxels. Only the
  // `extent` of the subblock lies inside the level; parts beyond it mean nothing. out: kShellParts * apronRangeBytes().
  void read(std::span<const std::byte> voxels, glm::ivec3 extent, std::span<std::byte> out) const;

 private:
  template <typename T, std::size_t channels, int side>
  void readSide(const std::byte* voxels, glm::ivec3 extent, std::byte* out) const;
  template <typename T, std::size_t channels>
  void readType(const std::byte* voxels, glm::ivec3 extent, std::byte* out) const;

  VoxelType type_;
  int side_;
  float threshold_;
  float empty_value_;
};

}  // namespace blockwalk
