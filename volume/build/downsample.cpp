// SPDX-License-Identifier: Apache-2.0
#include "volume/build/downsample.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
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
      empty_value_(emptyValue(type, channel)),
      first_full_(static_cast<std::uint32_t>(std::clamp(std::floor(threshold_) + 1, 0.0f, 65536.0f))) {}

void Downsampler::clear(std::span<std::byte> coarse) const {
  std::array<std::byte, 4> value{};
  if (type_ == VoxelType::f32) std::memcpy(value.data(), &empty_value_, sizeof(float));
  const auto narrow = static_cast<std::uint16_t>(type_ == VoxelType::f32 ? 0 : empty_value_);
  if (type_ != VoxelType::f32 && type_ != VoxelType::rgba8) std::memcpy(value.data(), &narrow, sizeof narrow);
  const std::size_t bytes = voxelBytes(type_);
  if (value == decltype(value){}) {
    std::ranges::fill(coarse, std::byte{0});
    return;
  }
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
std::uint32_t Downsampler::meanColor(std::span<const std::uint32_t> children) const {
  std::array<std::uint32_t, 3> color{};
  std::uint32_t density = 0;
  for (const std::uint32_t child : children) {
    const std::uint32_t own = child >> 24 >= first_full_ ? child >> 24 : 0;
    for (std::size_t channel = 0; channel < 3; ++channel) color[channel] += own * (child >> (8 * channel) & 0xff);
    density += own;
  }
  if (density == 0) return 0;
  const auto n = static_cast<std::uint32_t>(children.size());
  std::uint32_t packed = (2 * density + n) / (2 * n) << 24;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    packed |= (2 * color[channel] + density) / (2 * density) << (8 * channel);
  }
  return packed;
}

// An integer of twice the width: two voxels that lie side by side.
template <typename T>
using Pair = std::conditional_t<sizeof(T) == 1, std::uint16_t, std::uint32_t>;

// Planes 2z and 2z + 1 of a subblock, in words of W.
template <typename W, std::size_t words>
struct TwoPlanes {
  std::array<W, words> lower;
  std::array<W, words> upper;

  TwoPlanes(const std::byte* fine, std::size_t z) {
    std::memcpy(lower.data(), fine + 2 * z * sizeof lower, sizeof lower);
    std::memcpy(upper.data(), fine + (2 * z + 1) * sizeof upper, sizeof upper);
  }
};

// All 8 children are inside, for all voxels: rows at a time. The sums are taken in the order of meanScalar().
template <typename T, std::size_t side>
void Downsampler::averageWhole(const std::byte* fine, std::byte* octant) const {
  constexpr std::size_t half = side / 2;
  if constexpr (std::is_integral_v<T>) {
    using Wide = Pair<T>;
    constexpr int kBits = 8 * sizeof(T);
    constexpr auto kLow = static_cast<Wide>(std::numeric_limits<T>::max());
    std::array<T, half * half> out;
    for (std::size_t z = 0; z < half; ++z) {
      const TwoPlanes<Wide, side * half> planes(fine, z);
      std::array<Wide, side * half> sums;
      for (std::size_t i = 0; i < sums.size(); ++i) {
        sums[i] = static_cast<Wide>((planes.lower[i] & kLow) + (planes.lower[i] >> kBits) + (planes.upper[i] & kLow) +
                                    (planes.upper[i] >> kBits));
      }
      for (std::size_t y = 0; y < half; ++y) {
        for (std::size_t x = 0; x < half; ++x) {
          const Wide* pair = &sums[2 * y * half + x];
          out[y * half + x] = static_cast<T>(static_cast<Wide>(pair[0] + pair[half] + 4) >> 3);
        }
      }
      std::memcpy(octant + z * sizeof out, out.data(), sizeof out);
    }
  } else {
    std::array<T, side> row;
    std::array<double, half> sums;
    for (std::size_t z = 0; z < half; ++z) {
      for (std::size_t y = 0; y < half; ++y) {
        sums.fill(0);
        for (std::size_t child = 0; child < 4; ++child) {
          const std::size_t from = ((2 * z + child / 2) * side + 2 * y + child % 2) * side;
          std::memcpy(row.data(), fine + from * sizeof(T), side * sizeof(T));
          for (T& value : row) value = std::isfinite(value) ? value : empty_value_;
          for (std::size_t x = 0; x < half; ++x) {
            sums[x] += static_cast<double>(row[2 * x]);
            sums[x] += static_cast<double>(row[2 * x + 1]);
          }
        }
        for (std::size_t x = 0; x < half; ++x) row[x] = static_cast<T>(sums[x] / 8) + T{0};
        std::memcpy(octant + (z * half + y) * half * sizeof(T), row.data(), half * sizeof(T));
      }
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
std::uint32_t Downsampler::greatestColor(std::span<const std::uint32_t> children) const {
  std::uint32_t most = 0;
  for (const std::uint32_t child : children) most = child >> 24 > most >> 24 ? child : most;
  return most >> 24 >= first_full_ ? most : 0;
}

template <typename T, std::size_t side>
void Downsampler::greatestWhole(const std::byte* fine, std::byte* octant) const {
  constexpr std::size_t half = side / 2;
  const auto empty = static_cast<T>(empty_value_);
  std::array<T, half * half> out;
  for (std::size_t z = 0; z < half; ++z) {
    TwoPlanes<T, side * side> planes(fine, z);
    std::array<T, side* side>& most = planes.lower;
    if constexpr (std::is_integral_v<T>) {
      // What is made of odd rows is not used.
      for (std::size_t i = 0; i < most.size(); ++i) most[i] = std::max(most[i], planes.upper[i]);
      for (std::size_t i = 0; i < most.size() - side; ++i) most[i] = std::max(most[i], most[i + side]);
      std::array<Pair<T>, side * half> pairs;
      std::memcpy(pairs.data(), most.data(), sizeof pairs);
      constexpr auto kLow = static_cast<Pair<T>>(std::numeric_limits<T>::max());
      for (Pair<T>& pair : pairs) {
        pair = std::max<Pair<T>>(pair & kLow, static_cast<Pair<T>>(pair >> (8 * sizeof(T))));
        pair = pair >= first_full_ ? pair : static_cast<Pair<T>>(empty);
      }
      for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<T>(pairs[i / half * side + i % half]);
    } else {
      for (auto* plane : {&planes.lower, &planes.upper}) {
        for (T& value : *plane) value = std::isfinite(value) ? value : empty;
      }
      for (std::size_t i = 0; i < out.size(); ++i) {
        const std::size_t at = i / half * 2 * side + i % half * 2;
        T value = empty;
        for (const std::size_t x : {at, at + 1}) {
          T own = std::max(std::max(planes.lower[x], planes.lower[x + side]),
                           std::max(planes.upper[x], planes.upper[x + side]));
          value = x == at ? own : std::max(value, own);
        }
        out[i] = isEmptyDensity(value, threshold_) ? empty : value;
      }
    }
    std::memcpy(octant + z * sizeof out, out.data(), sizeof out);
  }
}

// Planes at a time; what meanColor() gives. Everything is an integer below 2^24, which floats hold, add and multiply
// exactly and many at a time.
template <std::size_t side>
void Downsampler::meanColorsWhole(const std::byte* fine, std::byte* octant) const {
  constexpr std::size_t half = side / 2;
  const auto first = static_cast<std::int32_t>(first_full_);
  for (std::size_t z = 0; z < half; ++z) {
    const TwoPlanes<std::uint32_t, side * side> planes(fine, z);
    std::array<std::int32_t, side * side> lower;  // densities, of empty voxels 0
    std::array<std::int32_t, side * side> upper;
    for (std::size_t i = 0; i < side * side; ++i) {
      lower[i] = static_cast<std::int32_t>(planes.lower[i] >> 24);
      upper[i] = static_cast<std::int32_t>(planes.upper[i] >> 24);
      lower[i] &= -static_cast<std::int32_t>(lower[i] >= first);
      upper[i] &= -static_cast<std::int32_t>(upper[i] >= first);
    }
    std::array<std::array<float, side * side>, 4> sums;  // of two voxels each: colours times density, density
    for (std::size_t i = 0; i < side * side; ++i) sums[3][i] = static_cast<float>(lower[i] + upper[i]);
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const auto color = [channel](std::uint32_t voxel) {
        return static_cast<float>(static_cast<std::int32_t>(voxel >> (8 * channel) & 0xff));
      };
      for (std::size_t i = 0; i < side * side; ++i) {
        sums[channel][i] = static_cast<float>(lower[i]) * color(planes.lower[i]) +
                           static_cast<float>(upper[i]) * color(planes.upper[i]);
      }
    }
    std::array<std::array<float, half * half>, 4> totals;  // of eight
    for (std::size_t sum = 0; sum < 4; ++sum) {
      std::array<float, half * side> rows;
      for (std::size_t y = 0; y < half; ++y) {
        const float* row = &sums[sum][2 * y * side];
        for (std::size_t x = 0; x < side; ++x) rows[y * side + x] = row[x] + row[side + x];
      }
      for (std::size_t i = 0; i < half * half; ++i) totals[sum][i] = rows[2 * i] + rows[2 * i + 1];
    }
    std::array<std::uint32_t, half * half> out;
    for (std::size_t i = 0; i < out.size(); ++i) {
      const auto density = static_cast<std::int32_t>(totals[3][i]);
      // Quotients that are not above 255: no float rounds up to the next integer.
      const auto divisor = static_cast<float>(std::max(2 * density, 1));
      std::uint32_t packed = static_cast<std::uint32_t>((2 * density + 8) >> 4) << 24;
      for (std::size_t channel = 0; channel < 3; ++channel) {
        const auto mean = static_cast<std::int32_t>((2 * totals[channel][i] + totals[3][i]) / divisor);
        packed |= static_cast<std::uint32_t>(mean) << (8 * channel);
      }
      out[i] = packed;
    }
    std::memcpy(octant + z * sizeof out, out.data(), sizeof out);
  }
}

// Pairs, then rows, then planes: of several that are greatest the first, as greatestColor() finds it.
template <std::size_t side>
void Downsampler::greatestColorsWhole(const std::byte* fine, std::byte* octant) const {
  constexpr std::size_t half = side / 2;
  const auto greater = [](std::uint32_t best, std::uint32_t other) {
    return static_cast<std::int32_t>(other >> 24) > static_cast<std::int32_t>(best >> 24) ? other : best;
  };
  const auto first = static_cast<std::int32_t>(std::max(first_full_, 1u));  // nothing where no density is above 0
  for (std::size_t z = 0; z < half; ++z) {
    const TwoPlanes<std::uint32_t, side * side> planes(fine, z);
    std::array<std::uint32_t, side * half> lower;
    std::array<std::uint32_t, side * half> upper;
    for (std::size_t i = 0; i < lower.size(); ++i) lower[i] = greater(planes.lower[2 * i], planes.lower[2 * i + 1]);
    for (std::size_t i = 0; i < upper.size(); ++i) upper[i] = greater(planes.upper[2 * i], planes.upper[2 * i + 1]);
    std::array<std::uint32_t, half * half> out;
    for (std::size_t y = 0; y < half; ++y) {
      for (std::size_t x = 0; x < half; ++x) {
        const std::size_t at = 2 * y * half + x;
        const std::uint32_t most = greater(greater(lower[at], lower[at + half]), greater(upper[at], upper[at + half]));
        out[y * half + x] = static_cast<std::int32_t>(most >> 24) >= first ? most : 0;
      }
    }
    std::memcpy(octant + z * sizeof out, out.data(), sizeof out);
  }
}

template <std::size_t side>
void Downsampler::coarsenWhole(const std::byte* fine, std::byte* octant) const {
  const bool mean = rule_ == Rule::mean;
  const auto scalar = [&]<typename T>(T) {
    return mean ? averageWhole<T, side>(fine, octant) : greatestWhole<T, side>(fine, octant);
  };
  switch (type_) {
    case VoxelType::u8:
      return scalar(std::uint8_t{});
    case VoxelType::u16:
      return scalar(std::uint16_t{});
    case VoxelType::f32:
      return scalar(float{});
    case VoxelType::rgba8:
      return mean ? meanColorsWhole<side>(fine, octant) : greatestColorsWhole<side>(fine, octant);
  }
}

void Downsampler::coarsen(std::span<const std::byte> fine, glm::ivec3 extent, std::span<std::byte> octant) const {
  const std::size_t bytes = voxelBytes(type_);
  const auto at = [bytes](int side, int x, int y, int z) {
    return static_cast<std::size_t>((z * side + y) * side + x) * bytes;
  };
  if (extent == glm::ivec3(side_) && rule_ != Rule::majority) {
    if (side_ == 4) return coarsenWhole<4>(fine.data(), octant.data());
    if (side_ == 8) return coarsenWhole<8>(fine.data(), octant.data());
    return coarsenWhole<16>(fine.data(), octant.data());
  }
  for (int z = 0; z < extent.z; z += 2) {
    for (int y = 0; y < extent.y; y += 2) {
      for (int x = 0; x < extent.x; x += 2) {
        std::array<const std::byte*, 8> children{};
        int count = 0;
        for (int child = 0; child < 8; ++child) {
          const glm::ivec3 own(x + (child & 1), y + (child >> 1 & 1), z + (child >> 2));
          if (own.x < extent.x && own.y < extent.y && own.z < extent.z) {
            children[static_cast<std::size_t>(count++)] = fine.data() + at(side_, own.x, own.y, own.z);
          }
        }
        std::byte* out = octant.data() + at(side_ / 2, x / 2, y / 2, z / 2);
        const auto store = [out](auto value) { std::memcpy(out, &value, sizeof value); };
        const auto scalar = [&](auto kind) {
          using T = decltype(kind);
          if (rule_ == Rule::majority) return majority<T>(children.data(), count);
          return rule_ == Rule::mean ? meanScalar<T>(children.data(), count) : greatest<T>(children.data(), count);
        };
        const auto color = [&](std::span<const std::byte* const> voxels) {
          std::array<std::uint32_t, 8> colors;
          for (std::size_t i = 0; i < voxels.size(); ++i) std::memcpy(&colors[i], voxels[i], sizeof colors[i]);
          const auto own = std::span(colors).first(voxels.size());
          return rule_ == Rule::mean ? meanColor(own) : greatestColor(own);
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
            store(color(std::span(children).first(static_cast<std::size_t>(count))));
            break;
        }
      }
    }
  }
}

}  // namespace blockwalk
