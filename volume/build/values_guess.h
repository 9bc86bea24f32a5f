// SPDX-License-Identifier: Apache-2.0
// Whether the values of a channel look like labels. A guess that can be wrong, so whoever takes it says so.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "volume/volume.h"

namespace blockwalk {

constexpr int kGuessStretch = 64;

// Looks at some of the neighbouring voxels of one channel of u8 or u16 while they pass by. Labels are few values, or
// regions of one value each whose numbers say nothing of their neighbours'; amounts change from voxel to voxel, and
// mostly by little.
class ValuesGuess {
 public:
  // `empty`: the greatest stored value that means nothing, as far as that is known before reading.
  ValuesGuess(VoxelType type, float empty);

  // One row; `x`: of its first voxel. Pairs between stretches of kGuessStretch voxels do not count, so that a row
  // counts the same in parts that end there.
  void add(std::span<const std::byte> row, int x);
  void add(const ValuesGuess& other);
  // `distinct`: how many different non-empty values there are.
  ChannelValues guess(std::size_t distinct) const;

 private:
  template <typename T>
  void addAs(std::span<const std::byte> row, std::size_t first);

  VoxelType type_;
  float empty_;
  std::uint64_t pairs_ = 0;  // of neighbours that are both not empty
  std::uint64_t equal_ = 0;
  std::uint64_t near_ = 0;  // different by at most 2
};

}  // namespace blockwalk
