// SPDX-License-Identifier: Apache-2.0
#include "volume/build/values_guess.h"

#include <algorithm>
#include <cstring>

namespace blockwalk {

ValuesGuess::ValuesGuess(VoxelType type, float empty) : type_(type), empty_(empty) {}

template <typename T>
void ValuesGuess::addAs(std::span<const std::byte> voxels) {
  const std::size_t count = voxels.size() / sizeof(T);
  const auto empty = static_cast<int>(std::clamp(empty_, -1.0f, 65536.0f));
  constexpr std::size_t kRun = 512;  // looked at of each kStep
  constexpr std::size_t kStep = 4096;
  for (std::size_t begin = 0; begin + 1 < count; begin += kStep) {
    const std::size_t end = std::min(begin + kRun, count - 1);
    std::uint32_t pairs = 0;
    std::uint32_t equal = 0;
    std::uint32_t near = 0;
    for (std::size_t i = begin; i < end; ++i) {
      T own{};
      T next{};
      std::memcpy(&own, voxels.data() + i * sizeof(T), sizeof own);
      std::memcpy(&next, voxels.data() + (i + 1) * sizeof(T), sizeof next);
      const bool both = own != empty && next != empty;
      const int step = static_cast<int>(own) - static_cast<int>(next);
      pairs += both ? 1 : 0;
      equal += both && step == 0 ? 1 : 0;
      near += both && step != 0 && step >= -2 && step <= 2 ? 1 : 0;
    }
    pairs_ += pairs;
    equal_ += equal;
    near_ += near;
  }
}

void ValuesGuess::add(std::span<const std::byte> voxels) {
  if (type_ == VoxelType::u8) addAs<std::uint8_t>(voxels);
  if (type_ == VoxelType::u16) addAs<std::uint16_t>(voxels);
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
