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
  std::array<T, 2 * kShellParts> parts;
  for (std::size_t dz = 0; dz < 3; ++dz) {
    const Ends& plane = planes[dz];
    std::array<std::array<T, n>, 3> least;  // by dy
    std::array<std::array<T, n>, 3> greatest;
    for (std::size_t x = 0; x < n; ++x) {
      least[0][x] = least[1][x] = plane.least[x];
      greatest[0][x] = greatest[1][x] = plane.greatest[x];
      least[2][x] = plane.least[(n - 1) * n + x];
      greatest[2][x] = plane.greatest[(n - 1) * n + x];
    }
    for (std::size_t y = 1; y < n; ++y) {
      for (std::size_t x = 0; x < n; ++x) {
        least[1][x] = std::min(least[1][x], plane.least[y * n + x]);
        greatest[1][x] = std::max(greatest[1][x], plane.greatest[y * n + x]);
      }
    }
    for (std::size_t dy = 0; dy < 3; ++dy) {
      T* part = parts.data() + 2 * (3 * (dy + 3 * dz));
      part[0] = least[dy].front();
      part[1] = greatest[dy].front();
      part[2] = *std::ranges::min_element(least[dy]);
      part[3] = *std::ranges::max_element(greatest[dy]);
      part[4] = least[dy].back();
      part[5] = greatest[dy].back();
    }
  }
  std::memcpy(out, parts.data(), sizeof parts);
}

}  // namespace blockwalk
