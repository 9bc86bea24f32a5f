// SPDX-License-Identifier: Apache-2.0
#include "volume/import/idx/idx_samples.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <type_traits>

namespace blockwalk {
namespace {

// Calls move(width) with a width that the compiler knows, where it is a usual one.
template <typename Move>
void withWidth(std::size_t width, Move move) {
  switch (width) {
    case 1:
      return move(std::integral_constant<std::size_t, 1>());
    case 2:
      return move(std::integral_constant<std::size_t, 2>());
    case 4:
      return move(std::integral_constant<std::size_t, 4>());
    case 8:
      return move(std::integral_constant<std::size_t, 8>());
    default:
      return move(width);
  }
}

template <typename T>
void fillWith(double value, std::span<std::byte> out) {
  T sample{};
  if constexpr (std::is_integral_v<T>) {
    // The greatest value of 64 bits is no double: what is at or beyond it is that value.
    const double least = static_cast<double>(std::numeric_limits<T>::min());
    const double end = static_cast<double>(std::numeric_limits<T>::max());
    sample = value >= end ? std::numeric_limits<T>::max() : static_cast<T>(std::max(value, least));
  } else {
    constexpr double kMost = std::numeric_limits<T>::max();
    sample = static_cast<T>(std::clamp(value, -kMost, kMost));
  }
  for (std::size_t i = 0; i < out.size(); i += sizeof(T)) std::memcpy(&out[i], &sample, sizeof(T));
}

}  // namespace

std::vector<std::uint32_t> rowsOfCodes(const IdxBits& bits, int begin, int end) {
  const glm::ivec3 extent = bits.extent(begin, end);
  // What each bit adds to the place.
  std::vector<std::uint32_t> steps;
  std::array<std::uint32_t, 3> next = {1, static_cast<std::uint32_t>(extent.x),
                                       static_cast<std::uint32_t>(extent.x) * static_cast<std::uint32_t>(extent.y)};
  for (int i = begin; i < end; ++i) {
    std::uint32_t& step = next[bits.axes[static_cast<std::size_t>(i)]];
    steps.push_back(step);
    step *= 2;
  }
  std::vector<std::uint32_t> places(std::size_t{1} << steps.size());
  for (std::size_t bit = 0; bit < steps.size(); ++bit) {
    const std::size_t half = std::size_t{1} << bit;
    for (std::size_t i = 0; i < half; ++i) places[half + i] = places[i] + steps[bit];
  }
  return places;
}

void scatterSamples(std::span<const std::byte> samples, std::size_t width, CodeSteps codes,
                    const std::vector<std::uint32_t>& places, std::span<std::byte> to) {
  withWidth(width, [&](auto bytes) {
    std::uint64_t code = codes.first;
    for (std::size_t at = 0; at < samples.size(); at += bytes, code += codes.step) {
      std::memcpy(&to[places[code] * std::size_t{bytes}], &samples[at], bytes);
    }
  });
}

void gatherSamples(std::span<const std::byte> from, std::size_t width, const std::vector<std::uint32_t>& places,
                   std::span<std::byte> to) {
  withWidth(width, [&](auto bytes) {
    for (std::size_t i = 0; i < places.size(); ++i) {
      std::memcpy(&to[i * bytes], &from[places[i] * std::size_t{bytes}], bytes);
    }
  });
}

void fillSamples(SampleType type, double value, std::span<std::byte> out) {
  switch (type) {
    case SampleType::u8:
      return fillWith<std::uint8_t>(value, out);
    case SampleType::i8:
      return fillWith<std::int8_t>(value, out);
    case SampleType::u16:
      return fillWith<std::uint16_t>(value, out);
    case SampleType::i16:
      return fillWith<std::int16_t>(value, out);
    case SampleType::u32:
      return fillWith<std::uint32_t>(value, out);
    case SampleType::i32:
      return fillWith<std::int32_t>(value, out);
    case SampleType::u64:
      return fillWith<std::uint64_t>(value, out);
    case SampleType::i64:
      return fillWith<std::int64_t>(value, out);
    case SampleType::f16:
      break;  // no header of this format has it
    case SampleType::f32:
      return fillWith<float>(value, out);
    case SampleType::f64:
      return fillWith<double>(value, out);
  }
}

}  // namespace blockwalk
