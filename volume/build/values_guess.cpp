// SPDX-License-Identifier: Apache-2.0
#include "volume/build/values_guess.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

namespace blockwalk {

ValuesGuess::ValuesGuess(VoxelType type, float empty) : type_(type), empty_(empty) {}

// Counted as narrow as the values are, many at a time.
template <typename T>
void ValuesGuess::addAs(std::span<const std::byte> row, std::size_t first) {
  const std::size_t count = row.size() / sizeof(T);
  const auto empty_value = static_cast<int>(std::clamp(empty_, -1.0f, 65536.0f));
  if (empty_value >= std::numeric_limits<T>::max()) return;  // all are
  const auto empty = static_cast<T>(std::max(empty_value, 0));
  const auto none_is_empty = static_cast<T>(empty_value < 0 ? 1 : 0);
  std::array<T, kGuessStretch> values;
  for (std::size_t at = 0; at < count;) {
    const std::size_t voxels = std::min(kGuessStretch - (first + at) % kGuessStretch, count - at);
    std::memcpy(values.data(), row.data() + at * sizeof(T), voxels * sizeof(T));
    at += voxels;
    T both = 0;
    T equal = 0;
    T near = 0;
    for (std::size_t i = 0; i + 1 < voxels; ++i) {
      const T own = values[i];
      const T next = values[i + 1];
      const auto apart = static_cast<T>(std::max(own, next) - std::min(own, next));
      const auto counts = static_cast<T>(none_is_empty | static_cast<T>((own > empty) & (next > empty)));
      both += counts;
      equal += counts & static_cast<T>(apart == 0);
      near += counts & static_cast<T>((apart != 0) & (apart <= 2));
    }
    pairs_ += both;
    equal_ += equal;
    near_ += near;
  }
}

void ValuesGuess::add(std::span<const std::byte> row, int x) {
  if (type_ == VoxelType::u8) addAs<std::uint8_t>(row, static_cast<std::size_t>(x));
  if (type_ == VoxelType::u16) addAs<std::uint16_t>(row, static_cast<std::size_t>(x));
}

void ValuesGuess::add(const ValuesGuess& other) {
  pairs_ += other.pairs_;
  equal_ += other.equal_;
  near_ += other.near_;
}

ChannelValues ValuesGuess::guess(std::size_t distinct) const {
  if (type_ != VoxelType::u8 && type_ != VoxelType::u16) return ChannelValues::intensity;
  // One value is a mask, whose mean is a share.
  if (distinct < 2) return ChannelValues::intensity;
  if (distinct <= 16) return ChannelValues::labels;
  const std::uint64_t differing = pairs_ - equal_;
  const bool regions = differing * 4 <= pairs_;
  const bool unrelated = near_ * 2 < differing;
  return regions && unrelated ? ChannelValues::labels : ChannelValues::intensity;
}

}  // namespace blockwalk
