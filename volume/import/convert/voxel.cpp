// SPDX-License-Identifier: Apache-2.0
#include "volume/import/convert/voxel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "volume/error.h"
#include "volume/import/convert/half.h"

namespace blockwalk {
namespace {

template <typename T>
T load(std::span<const std::byte> bytes, std::size_t index) {
  T value;
  std::memcpy(&value, bytes.data() + index * sizeof(T), sizeof(T));
  return value;
}

void swapSamples(std::span<std::byte> samples, std::size_t width) {
  for (std::size_t i = 0; i < samples.size(); i += width) std::reverse(&samples[i], &samples[i] + width);
}

// Signed samples move up by half their range, so that order is kept: -128 is stored as 0.
void flipSigns(std::span<const std::byte> samples, std::span<std::byte> voxels, std::size_t width) {
  std::memcpy(voxels.data(), samples.data(), samples.size());
  for (std::size_t i = width - 1; i < voxels.size(); i += width) voxels[i] ^= std::byte{0x80};
}

VoxelType storedType(const SampleFormat& format) {
  if (format.channels > 1) return VoxelType::rgba8;
  switch (format.type) {
    case SampleType::u8:
    case SampleType::i8:
      return VoxelType::u8;
    case SampleType::u16:
    case SampleType::i16:
      return VoxelType::u16;
    default:
      return VoxelType::f32;
  }
}

// Stored values of samples that descend: all bits of whole numbers, the sign of others.
void turnRound(VoxelType type, std::span<std::byte> voxels) {
  const std::size_t width = voxelBytes(type);
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const bool is_sign = i % width == width - 1;
    if (type != VoxelType::f32) voxels[i] = ~voxels[i];
    if (type == VoxelType::f32 && is_sign) voxels[i] ^= std::byte{0x80};
  }
}

// Rec. 709 weights in 1/10000; exact in 32 bits for 16-bit samples.
std::uint32_t luminance(std::uint32_t r, std::uint32_t g, std::uint32_t b) {
  return (r * 2126 + g * 7152 + b * 722 + 5000) / 10000;
}

}  // namespace

VoxelConverter::VoxelConverter(const SampleFormat& format, DensityRule rule, const std::string& source)
    : format_(format), rule_(rule), source_(source), type_(storedType(format)) {
  if (format.type == SampleType::i8) value_offset_ = format.descending ? 127 : -128;
  if (format.type == SampleType::i16) value_offset_ = format.descending ? 32767 : -32768;
  if (format.type == SampleType::u8 && format.descending) value_offset_ = 255;
  if (format.type == SampleType::u16 && format.descending) value_offset_ = 65535;
  const bool has_alpha = format.channels == 2 || format.channels == 4;
  if (format.channels == 1) {
    if (rule != DensityRule::automatic) failData("{}: density: the voxels are single values, not colours", source);
    return;
  }
  if (format.type != SampleType::u8 && format.type != SampleType::u16) {
    failData("{}: {} channels of type {}: colour must be u8 or u16", source, format.channels,
             sampleTypeName(format.type));
  }
  if (rule == DensityRule::alpha && !has_alpha) {
    failData("{}: density: alpha is asked for, and the colours have none; choose luminance or max", source);
  }
  if (rule == DensityRule::automatic) rule_ = has_alpha ? DensityRule::alpha : DensityRule::max;
}

bool VoxelConverter::mayRound() const {
  if (format_.channels > 1) return false;
  switch (format_.type) {
    case SampleType::u32:
    case SampleType::i32:
    case SampleType::u64:
    case SampleType::i64:
    case SampleType::f64:
      return true;
    default:
      return false;
  }
}

void VoxelConverter::moveBy(double offset) {
  if (mayRound()) moved_by_ = value_offset_ = offset;
}

void VoxelConverter::convert(std::span<std::byte> samples, std::span<std::byte> voxels) {
  BLOCKWALK_CHECK(samples.size() / format_.voxelBytes(), ==, voxels.size() / voxelBytes(type_));
  if (format_.swap_bytes) swapSamples(samples, sampleBytes(format_.type));
  convertAscending(samples, voxels);
  if (format_.descending && type_ != VoxelType::rgba8) turnRound(type_, voxels);
}

void VoxelConverter::convertAscending(std::span<std::byte> samples, std::span<std::byte> voxels) {
  const bool color = format_.channels > 1;
  switch (format_.type) {
    case SampleType::u8:
      if (color) return convertColor<std::uint8_t>(samples, voxels);
      std::memcpy(voxels.data(), samples.data(), samples.size());
      return;
    case SampleType::u16:
      if (color) return convertColor<std::uint16_t>(samples, voxels);
      std::memcpy(voxels.data(), samples.data(), samples.size());
      return;
    case SampleType::i8:
    case SampleType::i16:
      return flipSigns(samples, voxels, sampleBytes(format_.type));
    case SampleType::f16:
      return convertHalf(samples, voxels);
    case SampleType::f32:
      std::memcpy(voxels.data(), samples.data(), samples.size());
      return countNonfinite(voxels);
    case SampleType::u32:
      return convertToFloat<std::uint32_t>(samples, voxels);
    case SampleType::i32:
      return convertToFloat<std::int32_t>(samples, voxels);
    case SampleType::u64:
      return convertToFloat<std::uint64_t>(samples, voxels);
    case SampleType::i64:
      return convertToFloat<std::int64_t>(samples, voxels);
    case SampleType::f64:
      return convertToFloat<double>(samples, voxels);
  }
}

void VoxelConverter::countNonfinite(std::span<const std::byte> voxels) {
  for (std::size_t i = 0; i < voxels.size() / sizeof(float); ++i) {
    report_.nonfinite_voxels += std::isfinite(load<float>(voxels, i)) ? 0 : 1;
  }
}

void VoxelConverter::convertHalf(std::span<const std::byte> samples, std::span<std::byte> voxels) {
  for (std::size_t i = 0; i < samples.size() / 2; ++i) {
    const float stored = floatFromHalf(load<std::uint16_t>(samples, i));
    std::memcpy(voxels.data() + i * sizeof(float), &stored, sizeof stored);
  }
  countNonfinite(voxels);
}

template <typename T>
void VoxelConverter::convertToFloat(std::span<const std::byte> samples, std::span<std::byte> voxels) {
  for (std::size_t i = 0; i < samples.size() / sizeof(T); ++i) {
    const T sample = load<T>(samples, i);
    // long double holds every 64-bit integer, so the difference is the rounding and nothing else.
    const long double moved = static_cast<long double>(sample) - static_cast<long double>(moved_by_);
    const float stored = static_cast<float>(moved);
    std::memcpy(voxels.data() + i * sizeof(float), &stored, sizeof stored);
    if (std::isfinite(stored)) {
      const long double rounding = std::fabs(moved - static_cast<long double>(stored));
      report_.largest_rounding = std::max(report_.largest_rounding, static_cast<double>(rounding));
    } else if (std::isfinite(static_cast<double>(sample))) {
      failData("{}: value {} lies beyond what 32-bit floats hold", source_, static_cast<double>(sample));
    } else {
      ++report_.nonfinite_voxels;
    }
  }
}

template <typename T>
void VoxelConverter::convertColor(std::span<const std::byte> samples, std::span<std::byte> voxels) {
  constexpr std::uint32_t kFull = std::numeric_limits<T>::max();
  const std::size_t channels = static_cast<std::size_t>(format_.channels);
  const bool grey = channels == 2;
  if (sizeof(T) == 1 && channels == 4 && rule_ == DensityRule::alpha) {  // as it is stored
    std::memcpy(voxels.data(), samples.data(), samples.size());
    return;
  }
  std::uint32_t largest_error = 0;  // in 1/kFull of an 8-bit step
  for (std::size_t i = 0; i < voxels.size() / 4; ++i) {
    const std::uint32_t r = load<T>(samples, i * channels);
    const std::uint32_t g = grey ? r : load<T>(samples, i * channels + 1);
    const std::uint32_t b = grey ? r : load<T>(samples, i * channels + 2);
    std::uint32_t density = 0;
    switch (rule_) {
      case DensityRule::luminance:
        density = luminance(r, g, b);
        break;
      case DensityRule::max:
        density = std::max({r, g, b});
        break;
      default:
        density = load<T>(samples, i * channels + channels - 1);
        break;
    }
    const std::array<std::uint32_t, 4> values = {r, g, b, density};
    for (std::size_t c = 0; c < 4; ++c) {
      const std::uint32_t stored = (values[c] * 255 + kFull / 2) / kFull;
      const std::uint32_t exact = values[c] * 255;
      largest_error = std::max(largest_error, std::max(exact, stored * kFull) - std::min(exact, stored * kFull));
      voxels[i * 4 + c] = static_cast<std::byte>(stored);
    }
  }
  report_.largest_rounding = std::max(report_.largest_rounding, static_cast<double>(largest_error) / kFull);
}

}  // namespace blockwalk
