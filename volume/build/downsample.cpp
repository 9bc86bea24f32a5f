// SPDX-License-Identifier: Apache-2.0
#include "volume/build/downsample.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <span>
#include <type_traits>

namespace blockwalk {

Downsampler::Downsampler(VoxelType type, int side, const ChannelInfo& channel, Form form)
    : type_(type),
      rule_(channel.values == ChannelValues::labels ? Rule::majority
            : form == Form::maxima                  ? Rule::greatest
                                                    : Rule::mean),
      side_(side),
      threshold_(channel.empty_threshold),
      empty_value_(emptyValue(type, channel)) {}

void Downsampler::clear(std::span<std::byte> coarse) const {
  std::array<std::byte, 4> value{};
  if (type_ == VoxelType::f32) std::memcpy(value.data(), &empty_value_, sizeof(float));
  const auto narrow = static_cast<std::uint16_t>(type_ == VoxelType::f32 ? 0 : empty_value_);
  if (type_ != VoxelType::f32 && type_ != VoxelType::rgba8) std::memcpy(value.data(), &narrow, sizeof narrow);
  const std::size_t bytes = voxelBytes(type_);
  for (std::size_t i = 0; i < coarse.size(); i += bytes) std::memcpy(coarse.data() + i, value.data(), bytes);
}

// The most frequent value, where all that is empty is one; of as many of each, what is not empty, then the least.
template <typename T>
T Downsampler::majority(const std::byte* const* children, int count) const {
  std::array<T, 8> values{};
  for (int i = 0; i < count; ++i) {
    T value{};
    std::memcpy(&value, children[i], sizeof value);
    if (isEmptyDensity(static_cast<float>(value), threshold_)) value = static_cast<T>(empty_value_);
    values[static_cast<std::size_t>(i)] = value;
  }
  const auto all = std::span(values).first(static_cast<std::size_t>(count));
  T best = values[0];
  std::ptrdiff_t most = 0;
  for (const T value : all) {
    const std::ptrdiff_t own = std::ranges::count(all, value);
    const bool best_is_empty = isEmptyDensity(static_cast<float>(best), threshold_);
    const bool is_empty = isEmptyDensity(static_cast<float>(value), threshold_);
    const bool wins_tie = is_empty == best_is_empty ? value < best : best_is_empty;
    if (own > most || (own == most && wins_tie)) {
      best = value;
      most = own;
    }
  }
  return best;
}

template <typename T>
T Downsampler::meanScalar(const std::byte* const* children, int count) const {
  double sum = 0;
  for (int i = 0; i < count; ++i) {
    T value{};
    std::memcpy(&value, children[i], sizeof value);
    if constexpr (std::is_floating_point_v<T>) {
      if (!std::isfinite(value)) value = empty_value_;
    }
    sum += static_cast<double>(value);
  }
  if constexpr (std::is_floating_point_v<T>) return static_cast<T>(sum / count) + T{0};
  return static_cast<T>(std::floor(sum / count + 0.5));
}

// Density is the mean, colour the mean weighted by density: the average of premultiplied colours. Empty voxels are
// never shown and add nothing, whether they are stored or not.
std::uint32_t Downsampler::meanColor(const std::byte* const* children, int count) const {
  std::array<unsigned, 3> color{};
  unsigned density = 0;
  for (int i = 0; i < count; ++i) {
    const auto own = std::to_integer<unsigned>(children[i][3]);
    if (isEmptyDensity(static_cast<float>(own), threshold_)) continue;
    for (std::size_t channel = 0; channel < 3; ++channel) {
      color[channel] += own * std::to_integer<unsigned>(children[i][channel]);
    }
    density += own;
  }
  if (density == 0) return 0;
  const auto n = static_cast<unsigned>(count);
  std::uint32_t packed = (2 * density + n) / (2 * n) << 24;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    packed |= (2 * color[channel] + density) / (2 * density) << (8 * channel);
  }
  return packed;
}

// All 8 children are inside, for all voxels: rows at a time. The sums are taken in the order of meanScalar().
template <typename T>
void Downsampler::averageWhole(const std::byte* fine, std::byte* coarse) const {
  using Sum = std::conditional_t<std::is_floating_point_v<T>, double, std::uint32_t>;
  constexpr std::size_t kMostSide = 16;
  const auto side = static_cast<std::size_t>(side_);
  const std::size_t half = side / 2;
  std::array<T, kMostSide> row{};
  std::array<Sum, kMostSide / 2> sums;
  for (std::size_t z = 0; z < half; ++z) {
    for (std::size_t y = 0; y < half; ++y) {
      sums.fill(0);
      for (std::size_t child = 0; child < 4; ++child) {
        const std::size_t from = ((2 * z + child / 2) * side + 2 * y + child % 2) * side;
        std::memcpy(row.data(), fine + from * sizeof(T), side * sizeof(T));
        if constexpr (std::is_floating_point_v<T>) {
          for (T& value : row) value = std::isfinite(value) ? value : empty_value_;
        }
        for (std::size_t x = 0; x < half; ++x) {
          sums[x] += static_cast<Sum>(row[2 * x]);
          sums[x] += static_cast<Sum>(row[2 * x + 1]);
        }
      }
      for (std::size_t x = 0; x < half; ++x) {
        if constexpr (std::is_floating_point_v<T>) {
          row[x] = static_cast<T>(sums[x] / 8) + T{0};
        } else {
          row[x] = static_cast<T>((sums[x] + 4) / 8);
        }
      }
      std::memcpy(coarse + (z * side + y) * side * sizeof(T), row.data(), half * sizeof(T));
    }
  }
}

// Empty voxels count as the empty value, which no other density is below.
template <typename T>
T Downsampler::greatest(const std::byte* const* children, int count) const {
  T most = static_cast<T>(empty_value_);
  for (int i = 0; i < count; ++i) {
    T value{};
    std::memcpy(&value, children[i], sizeof value);
    if (!isEmptyDensity(static_cast<float>(value), threshold_)) most = std::max(most, value);
  }
  return most;
}

// The voxel of the greatest density with its colour, the first of several; nothing where all are empty.
std::uint32_t Downsampler::greatestColor(const std::byte* const* children, int count) const {
  std::uint32_t most = 0;
  for (int i = 0; i < count; ++i) {
    std::uint32_t voxel = 0;
    std::memcpy(&voxel, children[i], sizeof voxel);
    const bool empty = isEmptyDensity(static_cast<float>(voxel >> 24), threshold_);
    if (!empty && voxel >> 24 > most >> 24) most = voxel;
  }
  return most;
}

template <typename T>
void Downsampler::greatestWhole(const std::byte* fine, std::byte* coarse) const {
  constexpr std::size_t kMostSide = 16;
  const auto side = static_cast<std::size_t>(side_);
  const std::size_t half = side / 2;
  const auto empty = static_cast<T>(empty_value_);
  std::array<T, kMostSide> row{};
  std::array<T, kMostSide> most{};
  for (std::size_t z = 0; z < half; ++z) {
    for (std::size_t y = 0; y < half; ++y) {
      most.fill(empty);
      for (std::size_t child = 0; child < 4; ++child) {
        const std::size_t from = ((2 * z + child / 2) * side + 2 * y + child % 2) * side;
        std::memcpy(row.data(), fine + from * sizeof(T), side * sizeof(T));
        if constexpr (std::is_floating_point_v<T>) {
          for (T& value : row) value = std::isfinite(value) ? value : empty;
        }
        for (std::size_t x = 0; x < side; ++x) most[x] = std::max(most[x], row[x]);
      }
      for (std::size_t x = 0; x < half; ++x) {
        const T value = std::max(most[2 * x], most[2 * x + 1]);
        row[x] = isEmptyDensity(static_cast<float>(value), threshold_) ? empty : value;
      }
      std::memcpy(coarse + (z * side + y) * side * sizeof(T), row.data(), half * sizeof(T));
    }
  }
}

void Downsampler::add(std::span<const std::byte> fine, glm::ivec3 extent, std::span<std::byte> coarse,
                      glm::ivec3 octant) const {
  const std::size_t bytes = voxelBytes(type_);
  const auto at = [this, bytes](int x, int y, int z) {
    return static_cast<std::size_t>((z * side_ + y) * side_ + x) * bytes;
  };
  const glm::ivec3 base = octant * (side_ / 2);
  if (extent == glm::ivec3(side_) && type_ != VoxelType::rgba8 && rule_ != Rule::majority) {
    std::byte* out = coarse.data() + at(base.x, base.y, base.z);
    if (rule_ == Rule::greatest) {
      if (type_ == VoxelType::u8) return greatestWhole<std::uint8_t>(fine.data(), out);
      if (type_ == VoxelType::u16) return greatestWhole<std::uint16_t>(fine.data(), out);
      return greatestWhole<float>(fine.data(), out);
    }
    if (type_ == VoxelType::u8) return averageWhole<std::uint8_t>(fine.data(), out);
    if (type_ == VoxelType::u16) return averageWhole<std::uint16_t>(fine.data(), out);
    return averageWhole<float>(fine.data(), out);
  }
  for (int z = 0; z < extent.z; z += 2) {
    for (int y = 0; y < extent.y; y += 2) {
      for (int x = 0; x < extent.x; x += 2) {
        std::array<const std::byte*, 8> children{};
        int count = 0;
        for (int child = 0; child < 8; ++child) {
          const glm::ivec3 own(x + (child & 1), y + (child >> 1 & 1), z + (child >> 2));
          if (own.x < extent.x && own.y < extent.y && own.z < extent.z) {
            children[static_cast<std::size_t>(count++)] = fine.data() + at(own.x, own.y, own.z);
          }
        }
        std::byte* out = coarse.data() + at(base.x + x / 2, base.y + y / 2, base.z + z / 2);
        const auto store = [out](auto value) { std::memcpy(out, &value, sizeof value); };
        const auto scalar = [&](auto kind) {
          using T = decltype(kind);
          if (rule_ == Rule::majority) return majority<T>(children.data(), count);
          return rule_ == Rule::mean ? meanScalar<T>(children.data(), count) : greatest<T>(children.data(), count);
        };
        switch (type_) {
          case VoxelType::u8:
            store(scalar(std::uint8_t{}));
            break;
          case VoxelType::u16:
            store(scalar(std::uint16_t{}));
            break;
          case VoxelType::f32:
            store(scalar(float{}));
            break;
          case VoxelType::rgba8:
            store(rule_ == Rule::mean ? meanColor(children.data(), count) : greatestColor(children.data(), count));
            break;
        }
      }
    }
  }
}

}  // namespace blockwalk
