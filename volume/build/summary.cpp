// SPDX-License-Identifier: Apache-2.0
#include "volume/build/summary.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "volume/error.h"

namespace blockwalk {

HistogramBins::HistogramBins(const ChannelInfo& channel) : lo_(channel.histogram_lo) {
  const double width = static_cast<double>(channel.histogram_hi) - lo_;
  bins_per_unit_ = width > 0 ? kHistogramBins / width : 0;
}

std::size_t HistogramBins::of(float density) const {
  // Values outside occur only where they are empty; the upper bound itself belongs to the last bin.
  const double bin = (static_cast<double>(density) - lo_) * bins_per_unit_;
  return static_cast<std::size_t>(std::clamp(bin, 0.0, kHistogramBins - 1.0));
}

SubblockSummary::SubblockSummary(VoxelType type, int side, const ChannelInfo& channel)
    : type_(type), side_(side), threshold_(channel.empty_threshold), cuts_(channel.bin_cuts), histogram_(channel) {
  if (type_ == VoxelType::f32) return;
  const std::size_t values = type_ == VoxelType::u16 ? 65536 : 256;
  for (std::size_t value = 0; value < values; ++value) {
    const auto density = static_cast<float>(value);
    const int bin = rangeMaskBin(cuts_, density);
    masks_.push_back(isEmptyDensity(density, threshold_) ? std::uint8_t{0} : static_cast<std::uint8_t>(1 << bin));
  }
  const auto full = std::ranges::find_if(masks_, [](std::uint8_t mask) { return mask != 0; });
  if (full != masks_.end()) first_full_ = static_cast<std::size_t>(full - masks_.begin());
}

// Least and greatest of all, without a branch a voxel: what is empty is below all that is not. Then the mask, until it
// has every bin between the two, which is soon.
template <typename T, std::size_t channels>
Subblock SubblockSummary::scanIntegers(std::span<const std::byte> voxels, glm::ivec3 extent) const {
  constexpr std::size_t kStep = channels * sizeof(T);
  constexpr T kMost = std::numeric_limits<T>::max();
  const auto first_full = static_cast<T>(first_full_);
  const auto side = static_cast<std::size_t>(side_);
  const bool whole = extent == glm::ivec3(side_);
  // What is inside, in runs of voxels that lie one behind the other.
  const std::size_t run = whole ? side * side : static_cast<std::size_t>(extent.x);
  const int runs = whole ? side_ : extent.y * extent.z;
  const auto beginOf = [&](int index) {
    const int row = whole ? index * side_ : index / extent.y * side_ + index % extent.y;
    return voxels.data() + static_cast<std::size_t>(row) * side * kStep + (channels - 1) * sizeof(T);
  };
  const auto valueAt = [](const std::byte* from, std::size_t index) {
    T value{};
    std::memcpy(&value, from + index * kStep, sizeof value);
    return value;
  };
  // Of a known length, so that many are compared at a time.
  std::array<T, 64> values;
  std::array<T, 64> leasts;
  std::array<T, 64> greatests{};
  leasts.fill(kMost);
  for (int i = 0; i < runs; ++i) {
    const std::byte* from = beginOf(i);
    for (std::size_t begin = 0; begin < run; begin += values.size()) {
      const std::size_t count = std::min(values.size(), run - begin);
      if (count < values.size()) values.fill(valueAt(from, begin));
      if (channels == 1 && count == values.size()) {
        std::memcpy(values.data(), from + begin * kStep, sizeof values);
      } else {
        for (std::size_t x = 0; x < count; ++x) values[x] = valueAt(from, begin + x);
      }
      for (std::size_t x = 0; x < values.size(); ++x) {
        greatests[x] = std::max(greatests[x], values[x]);
        leasts[x] = std::min(leasts[x], values[x] >= first_full ? values[x] : kMost);
      }
    }
  }
  T least = kMost;
  T greatest = 0;
  for (const T value : leasts) least = std::min(least, value);
  for (const T value : greatests) greatest = std::max(greatest, value);
  if (masks_[greatest] == 0) return {};
  const unsigned all = 2u * masks_[greatest] - masks_[least];  // the bits from that of the least on
  unsigned mask = 0;
  for (int i = 0; i < runs && mask != all; ++i) {
    const std::byte* from = beginOf(i);
    for (std::size_t x = 0; x < run; ++x) mask |= masks_[valueAt(from, x)];
  }
  return {.density_min = static_cast<float>(least),
          .density_max = static_cast<float>(greatest),
          .range_mask = static_cast<std::uint8_t>(mask)};
}

template <bool counting>
Subblock SubblockSummary::scanFloats(std::span<const std::byte> voxels, glm::ivec3 extent,
                                     ChannelCounts* totals) const {
  Subblock result;
  float least = 0;
  float greatest = 0;
  for (int z = 0; z < extent.z; ++z) {
    for (int y = 0; y < extent.y; ++y) {
      const std::byte* row = voxels.data() + static_cast<std::size_t>((z * side_ + y) * side_) * sizeof(float);
      for (int x = 0; x < extent.x; ++x) {
        float value = 0;
        std::memcpy(&value, row + static_cast<std::size_t>(x) * sizeof(float), sizeof value);
        if (isEmptyDensity(value, threshold_)) continue;
        if (result.range_mask == 0) least = greatest = value;
        least = std::min(least, value);
        greatest = std::max(greatest, value);
        result.range_mask = static_cast<std::uint8_t>(result.range_mask | 1 << rangeMaskBin(cuts_, value));
        if constexpr (counting) {
          ++totals->nonempty_voxels;
          ++totals->histogram[histogram_.of(value)];
        }
      }
    }
  }
  result.density_min = least + 0.0f;  // never -0, so that equal volumes are equal bytes
  result.density_max = greatest + 0.0f;
  return result;
}

Subblock SubblockSummary::summarise(std::span<const std::byte> voxels, glm::ivec3 extent) const {
  switch (type_) {
    case VoxelType::u8:
      return scanIntegers<std::uint8_t, 1>(voxels, extent);
    case VoxelType::rgba8:
      return scanIntegers<std::uint8_t, 4>(voxels, extent);
    case VoxelType::u16:
      return scanIntegers<std::uint16_t, 1>(voxels, extent);
    case VoxelType::f32:
      return scanFloats<false>(voxels, extent, nullptr);
  }
  return {};
}

Subblock SubblockSummary::summariseAndCount(std::span<const std::byte> voxels, glm::ivec3 extent,
                                            ChannelCounts& totals) const {
  BLOCKWALK_CHECK(type_ == VoxelType::f32, ==, true);
  return scanFloats<true>(voxels, extent, &totals);
}

}  // namespace blockwalk
