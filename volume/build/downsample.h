// SPDX-License-Identifier: Apache-2.0
// One channel of a subblock of a level made into an octant of a subblock of the next coarser level.
#pragma once

#include <cstdint>
#include <span>

#include "volume/volume.h"

namespace blockwalk {

class Downsampler {
 public:
  // Takes value map and threshold of the channel, which must be final. `side`: of a subblock, voxels.
  Downsampler(VoxelType type, int side, const ChannelInfo& channel, Form form);

  // Fills a coarse subblock with what a coarse voxel is while none of its children is stored.
  void clear(std::span<std::byte> coarse) const;
  // `fine` is a subblock with `extent` voxels inside its level; `octant` (0 or 1 an axis) is where it lies in `coarse`.
  // A coarse voxel is the mean of its children inside the level, or their most frequent label, or that of the greatest
  // density (docs/format.md, "Coarser levels").
  void add(std::span<const std::byte> fine, glm::ivec3 extent, std::span<std::byte> coarse, glm::ivec3 octant) const;

 private:
  template <typename T>
  void averageWhole(const std::byte* fine, std::byte* coarse) const;
  template <typename T>
  T majority(const std::byte* const* children, int count) const;
  template <typename T>
  T meanScalar(const std::byte* const* children, int count) const;
  std::uint32_t meanColor(const std::byte* const* children, int count) const;

  template <typename T>
  void greatestWhole(const std::byte* fine, std::byte* coarse) const;
  template <typename T>
  T greatest(const std::byte* const* children, int count) const;
  std::uint32_t greatestColor(const std::byte* const* children, int count) const;

  enum class Rule { mean, majority, greatest };
  VoxelType type_;
  Rule rule_;
  int side_;
  float threshold_;
  float empty_value_;  // stored units
};

}  // namespace blockwalk
