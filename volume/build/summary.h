// SPDX-License-Identifier: Apache-2.0
// What a record says of a subblock's voxels in one channel.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "volume/volume.h"

namespace blockwalk {

// What is counted of one channel over all subblocks of level 0.
struct ChannelCounts {
  std::uint64_t nonempty_voxels = 0;
  std::array<std::uint64_t, kHistogramBins> histogram{};

  void add(const ChannelCounts& other) {
    nonempty_voxels += other.nonempty_voxels;
    for (std::size_t bin = 0; bin < histogram.size(); ++bin) histogram[bin] += other.histogram[bin];
  }
};

class SubblockSummary {
 public:
  // Takes threshold, cuts and histogram bounds of the channel, which must be final. `side`: of a subblock, voxels.
  SubblockSummary(VoxelType type, int side, const ChannelInfo& channel);

  // Minimum, maximum and mask over the non-empty voxels inside `extent`; the mask is 0 when there are none.
  Subblock summarise(std::span<const std::byte> voxels, glm::ivec3 extent) const;
  // The same, and adds those voxels to the totals.
  Subblock summariseAndCount(std::span<const std::byte> voxels, glm::ivec3 extent, ChannelCounts& totals) const;

 private:
  template <typename T, std::size_t channels, bool counting>
  Subblock scan(std::span<const std::byte> voxels, glm::ivec3 extent, ChannelCounts* totals) const;
  template <bool counting>
  Subblock scanType(std::span<const std::byte> voxels, glm::ivec3 extent, ChannelCounts* totals) const;
  std::uint8_t maskOf(float density) const;
  std::uint8_t histogramBinOf(float density) const;

  VoxelType type_;
  int side_;
  float threshold_;
  std::array<float, kRangeMaskBins - 1> cuts_;
  double histogram_lo_;
  double bins_per_unit_;
  // By value, for the integer types: range mask (0: empty) and histogram bin.
  std::vector<std::uint8_t> masks_;
  std::vector<std::uint8_t> bins_;
};

}  // namespace blockwalk
