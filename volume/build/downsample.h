// SPDX-License-Identifier: Apache-2.0
// One channel of a subblock of a level made into an octant of a subblock of the next coarser level. Nothing changes
// behind a downsampler: several threads may ask at the same time.
#pragma once

#include <cstddef>
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
  // `fine` is a subblock with `extent` voxels inside its level; `octant` gets the coarse voxels that have a child
  // inside, x fastest, side / 2 voxels an axis, and keeps the others. A coarse voxel is the mean of its children inside
  // the level, or their most frequent label, or that of the greatest density (docs/format.md, "Coarser levels").
  void coarsen(std::span<const std::byte> fine, glm::ivec3 extent, std::span<std::byte> octant) const;

 private:
  // Of a subblock that lies inside its level whole.
  template <std::size_t side>
  void coarsenWhole(const std::byte* fine, std::byte* octant) const;
  template <std::size_t side>
  void meanColorsWhole(const std::byte* fine, std::byte* octant) const;
  template <std::size_t side>
  void greatestColorsWhole(const std::byte* fine, std::byte* octant) const;
  template <typename T, std::size_t side>
  void averageWhole(const std::byte* fine, std::byte* octant) const;
  template <typename T>
  T majority(const std::byte* const* children, int count) const;
  template <typename T>
  T meanScalar(const std::byte* const* children, int count) const;
  std::uint32_t meanColor(std::span<const std::uint32_t> children) const;

  template <typename T, std::size_t side>
  void greatestWhole(const std::byte* fine, std::byte* octant) const;
  template <typename T>
  T greatest(const std::byte* const* children, int count) const;
  std::uint32_t greatestColor(std::span<const std::uint32_t> children) const;

  enum class Rule { mean, majority, greatest };
  VoxelType type_;
  Rule rule_;
  int side_;
  float threshold_;
  float empty_value_;         // stored units
  std::uint32_t first_full_;  // of integers: the least that is not empty; beyond the type where none is
};

}  // namespace blockwalk
