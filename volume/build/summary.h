// SPDX-License-Identifier: Apache-2.0
// What a record says of a subblock's voxels in one channel.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "volume/volume.h"

namespace blockwalk {

// What is counted of one channel over all subblocks of level 0: of floats. Integers were counted value by value before.
struct ChannelCounts {
  std::uint64_t nonempty_voxels = 0;
  std::array<std::uint64_t, kHistogramBins> histogram{};

  void add(const ChannelCounts& other) {
    nonempty_voxels += other.nonempty_voxels;
    for (std::size_t bin = 0; bin < histogram.size(); ++bin) histogram[bin] += other.histogram[bin];
  }
};

// The bin of a density in a channel's histogram, whose bounds must be final.
class HistogramBins {
 public:
  explicit HistogramBins(const ChannelInfo& channel);
  std::size_t of(float density) const;

 private:
  double lo_;
  double bins_per_unit_;
};

class SubblockSummary {
 public:
  // Takes threshold, cuts and histogram bounds of the channel, which must be final. `side`: of a subblock, voxels.
  // Nothing changes behind this: several threads may ask at the same time.
  SubblockSummary(VoxelType type, int side, const ChannelInfo& channel);

  // Minimum, maximum and mask over the non-empty voxels inside `extent`; the mask is 0 when there are none.
  Subblock summarise(std::span<const std::byte> voxels, glm::ivec3 extent) const;
  // The same, and adds those voxels to the totals: of f32.
  Subblock summariseAndCount(std::span<const std::byte> voxels, glm::ivec3 extent, ChannelCounts& totals) const;

 private:
  template <typename T, std::size_t channels>
  Subblock scanIntegers(std::span<const std::byte> voxels, glm::ivec3 extent) const;
  template <bool counting>
  Subblock scanFloats(std::span<const std::byte> voxels, glm::ivec3 extent, ChannelCounts* totals) const;

  VoxelType type_;
  int side_;
  float threshold_;
  std::array<float, kRangeMaskBins - 1> cuts_;
  HistogramBins histogram_;
  // For the integer types: masks by value, 0 for what is empty; the least value that is not, or 0 where all are.
  std::vector<std::uint8_t> masks_;
  std::size_t first_full_ = 0;
};

}  // namespace blockwalk
