// SPDX-License-Identifier: Apache-2.0
// The number types that image files hold, before conversion to a stored voxel type.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <string_view>

namespace blockwalk {

enum class SampleType : std::uint8_t { u8, i8, u16, i16, u32, i32, u64, i64, f16, f32, f64 };

constexpr std::size_t sampleBytes(SampleType type) {
  switch (type) {
    case SampleType::u8:
    case SampleType::i8:
      return 1;
    case SampleType::u16:
    case SampleType::i16:
    case SampleType::f16:
      return 2;
    case SampleType::u32:
    case SampleType::i32:
    case SampleType::f32:
      return 4;
    case SampleType::u64:
    case SampleType::i64:
    case SampleType::f64:
      return 8;
  }
  return 0;
}

constexpr std::string_view sampleTypeName(SampleType type) {
  constexpr std::string_view kNames[] = {"u8", "i8", "u16", "i16", "u32", "i32", "u64", "i64", "f16", "f32", "f64"};
  return kNames[static_cast<std::size_t>(type)];
}

// What one voxel is in the file: 1 channel (scalar), 2 (grey, alpha), 3 (RGB) or 4 (RGBA), interleaved.
struct SampleFormat {
  SampleType type = SampleType::u8;
  int channels = 1;
  bool swap_bytes = false;  // the file's byte order is not this machine's
  bool descending = false;  // single values: the greater a sample, the less it means; stored values ascend
  bool operator==(const SampleFormat&) const = default;
  std::size_t voxelBytes() const { return sampleBytes(type) * static_cast<std::size_t>(channels); }
};

// A dense array in x-fastest order; every side is 1..kMaxDim, so that the product below fits 64 bits.
inline std::uint64_t arrayBytes(const SampleFormat& format, glm::ivec3 dims) {
  return static_cast<std::uint64_t>(dims.x) * static_cast<std::uint64_t>(dims.y) * static_cast<std::uint64_t>(dims.z) *
         format.voxelBytes();
}

}  // namespace blockwalk
