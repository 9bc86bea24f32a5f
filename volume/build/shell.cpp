// SPDX-License-Identifier: Apache-2.0
#include "volume/build/shell.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "volume/error.h"
#include "volume/file/layout.h"

namespace blockwalk {
namespace {

// The first row of a plane, what `fold` makes of all, and the last. Of integers halves of all rows at a time, of floats
// one after the other, so that of 0 and -0 the first stays.
template <typename T, std::size_t n, typename Fold>
void foldRows(std::array<T, n * n>& plane, T* rows, Fold fold) {
  std::memcpy(rows, plane.data(), n * sizeof(T));
  std::memcpy(rows + 2 * n, plane.data() + (n - 1) * n, n * sizeof(T));
  if constexpr (std::is_floating_point_v<T>) {
    for (std::size_t y = 1; y < n; ++y) {
      for (std::size_t x = 0; x < n; ++x) plane[x] = fold(plane[x], plane[y * n + x]);
    }
  } else {
    for (std::size_t part = n * n / 2; part >= n; part /= 2) {
      for (std::size_t i = 0; i < part; ++i) plane[i] = fold(plane[i], plane[part + i]);
    }
  }
  std::memcpy(rows + n, plane.data(), n * sizeof(T));
}

// Leaves in the first of each of 9 rows what `fold` makes of the row: of integers halves of all rows at a time, of
// floats one after the other, so that of 0 and -0 the first stays.
template <typename T, std::size_t n, typename Fold>
void foldAlong(std::array<T, 10 * n>& rows, Fold fold) {
  if constexpr (std::is_floating_point_v<T>) {
    for (std::size_t i = 0; i < 9 * n; i += n) {
      for (std::size_t x = 1; x < n; ++x) rows[i] = fold(rows[i], rows[i + x]);
    }
    return;
  }
  for (std::size_t step = n / 2; step > 0; step /= 2) {
    for (std::size_t i = 0; i < 9 * n; ++i) rows[i] = fold(rows[i], rows[i + step]);
  }
}

}  // namespace

ShellReader::ShellReader(VoxelType type, int side, const ChannelInfo& channel)
    : type_(type), side_(side), threshold_(channel.empty_threshold), empty_value_(emptyValue(type, channel)) {}

void ShellReader::read(std::span<const std::byte> voxels, glm::ivec3 extent, std::span<std::byte> out) const {
  BLOCKWALK_CHECK(out.size(), ==, kShellParts * apronRangeBytes(type_));
  switch (type_) {
    case VoxelType::u8:
      return readType<std::uint8_t, 1>(voxels.data(), extent, out.data());
    case VoxelType::rgba8:
      return readType<std::uint8_t, 4>(voxels.data(), extent, out.data());
    case VoxelType::u16:
      return readType<std::uint16_t, 1>(voxels.data(), extent, out.data());
    case VoxelType::f32:
      return readType<float, 1>(voxels.data(), extent, out.data());
  }
}

template <typename T, std::size_t channels>
void ShellReader::readType(const std::byte* voxels, glm::ivec3 extent, std::byte* out) const {
  if (side_ == 4) return readSide<T, channels, 4>(voxels, extent, out);
  if (side_ == 8) return readSide<T, channels, 8>(voxels, extent, out);
  return readSide<T, channels, 16>(voxels, extent, out);
}

// An axis after the other, whole planes and rows at a time: least and greatest over all, the first and the last.
template <typename T, std::size_t channels, int side>
void ShellReader::readSide(const std::byte* voxels, glm::ivec3 extent, std::byte* out) const {
  constexpr std::size_t n = side;
  const auto empty_value = static_cast<T>(empty_value_);
  std::array<T, n * n * n> settled;
  for (std::size_t i = 0; i < settled.size(); ++i) {
    std::memcpy(&settled[i], voxels + (i * channels + channels - 1) * sizeof(T), sizeof(T));
  }
  if constexpr (std::is_integral_v<T>) {
    // Densities above a threshold are those from an integer on, and the comparison stays as narrow as they are.
    constexpr float kGreatest = std::numeric_limits<T>::max();
    const auto first = static_cast<T>(threshold_ < 0 ? 0 : std::min(std::floor(threshold_) + 1, kGreatest));
    for (T& value : settled) value = value >= first ? value : empty_value;
    if (threshold_ >= kGreatest) settled.fill(empty_value);
  } else {
    for (T& value : settled) value = isEmptyDensity(value, threshold_) ? empty_value : value;
  }
  if (extent != glm::ivec3(side)) {  // beyond the level the nearest inside, which changes no part
    for (std::size_t i = settled.size(); i-- > 0;) {
      const auto at = static_cast<int>(i);
      const glm::ivec3 p = glm::min(glm::ivec3(at % side, at / side % side, at / (side * side)), extent - 1);
      settled[i] = settled[static_cast<std::size_t>(p.x + side * (p.y + side * p.z))];
    }
  }
  struct Ends {
    std::array<T, n * n> least;
    std::array<T, n * n> greatest;
  };
  std::array<Ends, 3> planes;  // by dz
  const auto copyPlane = [&](Ends& plane, std::size_t z) {
    std::copy_n(settled.begin() + static_cast<std::ptrdiff_t>(z * n * n), n * n, plane.least.begin());
    plane.greatest = plane.least;
  };
  copyPlane(planes[0], 0);
  copyPlane(planes[1], 0);
  copyPlane(planes[2], n - 1);
  for (std::size_t z = 1; z < n; ++z) {
    for (std::size_t i = 0; i < n * n; ++i) {
      planes[1].least[i] = std::min(planes[1].least[i], settled[z * n * n + i]);
      planes[1].greatest[i] = std::max(planes[1].greatest[i], settled[z * n * n + i]);
    }
  }
  const auto lesser = [](T a, T b) { return std::min(a, b); };
  const auto greater = [](T a, T b) { return std::max(a, b); };
  // Of each plane and dy a row; one more is read and not used.
  std::array<T, 10 * n> least{};
  std::array<T, 10 * n> greatest{};
  for (std::size_t dz = 0; dz < 3; ++dz) {
    foldRows<T, n>(planes[dz].least, least.data() + 3 * dz * n, lesser);
    foldRows<T, n>(planes[dz].greatest, greatest.data() + 3 * dz * n, greater);
  }
  std::array<T, 2 * kShellParts> parts;
  for (std::size_t row = 0; row < 9; ++row) {
    T* part = parts.data() + 6 * row;
    part[0] = least[row * n];
    part[1] = greatest[row * n];
    part[4] = least[row * n + n - 1];
    part[5] = greatest[row * n + n - 1];
  }
  foldAlong<T, n>(least, lesser);
  foldAlong<T, n>(greatest, greater);
  for (std::size_t row = 0; row < 9; ++row) {
    parts[6 * row + 2] = least[row * n];
    parts[6 * row + 3] = greatest[row * n];
  }
  std::memcpy(out, parts.data(), sizeof parts);
}

}  // namespace blockwalk
