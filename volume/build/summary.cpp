// SPDX-License-Identifier: Apache-2.0
#include "volume/build/summary.h"

#include <algorithm>
#include <cstring>
#include <type_traits>

namespace blockwalk {

SubblockSummary::SubblockSummary(VoxelType type, int side, const ChannelInfo& channel)
    : type_(type),
      side_(side),
      threshold_(channel.empty_threshold),
      cuts_(channel.bin_cuts),
      histogram_lo_(channel.histogram_lo) {
  const double width = static_cast<double>(channel.histogram_hi) - histogram_lo_;
  bins_per_unit_ = width > 0 ? kHistogramBins / width : 0;
  if (type_ == VoxelType::f32) return;
  const std::size_t values = type_ == VoxelType::u16 ? 65536 : 256;
  for (std::size_t value = 0; value < values; ++value) {
    const auto density = static_cast<float>(value);
    masks_.push_back(isEmptyDensity(density, threshold_) ? std::uint8_t{0} : maskOf(density));
    bins_.push_back(histogramBinOf(density));
  }
}

std::uint8_t SubblockSummary::maskOf(float density) const {
  return static_cast<std::uint8_t>(1 << rangeMaskBin(cuts_, density));
}

std::uint8_t SubblockSummary::histogramBinOf(float density) const {
  // Values outside occur only where they are empty; the upper bound itself belongs to the last bin.
  const double bin = (static_cast<double>(density) - histogram_lo_) * bins_per_unit_;
  return static_cast<std::uint8_t>(std::clamp(bin, 0.0, kHistogramBins - 1.0));
}

template <typename T, std::size_t channels, bool counting>
Subblock SubblockSummary::scan(std::span<const std::byte> voxels, glm::ivec3 extent, ChannelCounts* totals) const {
  Subblock result;
  T least{};
  T greatest{};
  for (int z = 0; z < extent.z; ++z) {
    for (int y = 0; y < extent.y; ++y) {
      const std::byte* row = voxels.data() + static_cast<std::size_t>((z * side_ + y) * side_) * sizeof(T) * channels;
      for (int x = 0; x < extent.x; ++x) {
        T value{};
        std::memcpy(&value, row + (static_cast<std::size_t>(x) * channels + channels - 1) * sizeof(T), sizeof value);
        std::uint8_t mask = 0;
        if constexpr (std::is_integral_v<T>) {
          mask = masks_[value];
        } else if (!isEmptyDensity(value, threshold_)) {
          mask = maskOf(value);
        }
        if (mask == 0) continue;
        if (result.range_mask == 0) least = greatest = value;
        least = std::min(least, value);
        greatest = std::max(greatest, value);
        result.range_mask |= mask;
        if constexpr (counting) {
          ++totals->nonempty_voxels;
          std::uint8_t bin = 0;
          if constexpr (std::is_integral_v<T>) {
            bin = bins_[value];
          } else {
            bin = histogramBinOf(value);
          }
          ++totals->histogram[bin];
        }
      }
    }
  }
  result.density_min = static_cast<float>(least) + 0.0f;  // never -0, so that equal volumes are equal bytes
  result.density_max = static_cast<float>(greatest) + 0.0f;
  return result;
}

template <bool counting>
Subblock SubblockSummary::scanType(std::span<const std::byte> voxels, glm::ivec3 extent, ChannelCounts* totals) const {
  switch (type_) {
    case VoxelType::u8:
      return scan<std::uint8_t, 1, counting>(voxels, extent, totals);
    case VoxelType::rgba8:
      return scan<std::uint8_t, 4, counting>(voxels, extent, totals);
    case VoxelType::u16:
      return scan<std::uint16_t, 1, counting>(voxels, extent, totals);
    case VoxelType::f32:
      return scan<float, 1, counting>(voxels, extent, totals);
  }
  return {};
}

Subblock SubblockSummary::summarise(std::span<const std::byte> voxels, glm::ivec3 extent) const {
  return scanType<false>(voxels, extent, nullptr);
}

Subblock SubblockSummary::summariseAndCount(std::span<const std::byte> voxels, glm::ivec3 extent,
                                            ChannelCounts& totals) const {
  return scanType<true>(voxels, extent, &totals);
}

}  // namespace blockwalk
