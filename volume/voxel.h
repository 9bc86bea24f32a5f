// SPDX-License-Identifier: Apache-2.0
// Voxel formats as stored, and the density of a voxel.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace blockwalk {

enum class VoxelType : std::uint8_t { rgba8 = 1, u8 = 2, u16 = 3, f32 = 4 };

constexpr std::size_t voxelBytes(VoxelType type) {
  switch (type) {
    case VoxelType::u8:
      return 1;
    case VoxelType::u16:
      return 2;
    case VoxelType::rgba8:
    case VoxelType::f32:
      return 4;
  }
  return 0;
}

constexpr std::string_view voxelTypeName(VoxelType type) {
  switch (type) {
    case VoxelType::rgba8:
      return "rgba8";
    case VoxelType::u8:
      return "u8";
    case VoxelType::u16:
      return "u16";
    case VoxelType::f32:
      return "f32";
  }
  return "";
}

// The density of one stored voxel, in stored units: alpha of rgba8, else the scalar. Exact in a float for every type.
// `voxel` points at voxelBytes(type) bytes, of any alignment.
inline float storedDensity(VoxelType type, const std::byte* voxel) {
  switch (type) {
    case VoxelType::rgba8:
      return static_cast<float>(std::to_integer<std::uint8_t>(voxel[3]));
    case VoxelType::u8:
      return static_cast<float>(std::to_integer<std::uint8_t>(voxel[0]));
    case VoxelType::u16: {
      std::uint16_t value = 0;
      std::memcpy(&value, voxel, sizeof value);
      return static_cast<float>(value);
    }
    case VoxelType::f32: {
      float value = 0;
      std::memcpy(&value, voxel, sizeof value);
      return value;
    }
  }
  return 0;
}

// A voxel is empty when its density is at most the threshold, or NaN, or infinite.
inline bool isEmptyDensity(float density, float empty_threshold) {
  return !(density > empty_threshold) || !std::isfinite(density);
}

}  // namespace blockwalk
