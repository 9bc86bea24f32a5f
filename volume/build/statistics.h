// SPDX-License-Identifier: Apache-2.0
// What the first pass learns of the densities, and what follows from it: the empty threshold, the range, the mask bins.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "volume/build/builder.h"
#include "volume/volume.h"

namespace blockwalk {

// A channel's empty threshold in stored units where the options or the type decide it before any voxel is read: stated
// by the options, or 0 data units because the stored type has no negative values.
std::optional<float> thresholdBeforeReading(const SourceInfo& source, std::size_t channel, const BuildOptions& options);

// Of one channel.
class DensityStatistics {
 public:
  // `reference`: the threshold that is known, else the stored value of 0 data units.
  DensityStatistics(VoxelType type, float reference);

  void add(std::span<const std::byte> voxels);
  // As many voxels like this one.
  void add(std::span<const std::byte> voxel, std::uint64_t count);
  // What was counted of other voxels, of the same type and reference.
  void add(const DensityStatistics& other);

  // What follows from the voxels where it is not known before.
  float emptyThreshold(std::optional<float> known) const;
  // How many different values are not empty; exact for integers.
  std::size_t distinctAbove(float threshold) const;
  // Fills empty_threshold, density_min, density_max, bin_cuts, histogram_lo, histogram_hi, nonfinite_voxels, and of
  // integers nonempty_voxels and histogram: of floats the value of each voxel is no longer known.
  void describe(ChannelInfo& channel, std::optional<float> threshold, MaskBins bins) const;

 private:
  void addFloats(std::span<const std::byte> voxels);
  void findRange(ChannelInfo& channel, std::optional<float> threshold) const;
  void countNonEmpty(ChannelInfo& channel) const;
  std::array<float, kRangeMaskBins - 1> quantileCuts(float threshold, float density_max) const;

  VoxelType type_;
  float reference_;
  std::uint64_t nonfinite_ = 0;
  // Voxels by densityKey(), of which there are densityKeys(): exact for integers, the sign, exponent and 7 bits of a
  // float.
  std::vector<std::uint64_t> counts_;
  // f32 only: the least finite density, the least above that, the least above the reference, the greatest.
  float least_;
  float second_;
  float above_reference_;
  float greatest_;
};

// A 16-bit key that ascends with the density, and the least density that has a key.
std::uint16_t densityKey(VoxelType type, float density);
float densityOfKey(VoxelType type, std::uint16_t key);
// One above the greatest key.
constexpr std::size_t densityKeys(VoxelType type) {
  return type == VoxelType::u8 || type == VoxelType::rgba8 ? 256 : 65536;
}

}  // namespace blockwalk
