// SPDX-License-Identifier: Apache-2.0
#include "volume/build/strip_cutter.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <type_traits>

#include "volume/build/scan.h"

namespace blockwalk {
namespace {

// No early exit inside a run, so that the compiler compares many voxels at a time.
template <typename T, std::size_t channels>
bool anyAbove(std::span<const std::byte> voxels, float threshold) {
  constexpr std::size_t kRun = 1024 * sizeof(T) * channels;
  for (std::size_t begin = 0; begin < voxels.size(); begin += kRun) {
    const std::size_t end = std::min(begin + kRun, voxels.size());
    bool any = false;
    T greatest{};
    for (std::size_t i = begin; i < end; i += sizeof(T) * channels) {
      T value{};
      std::memcpy(&value, voxels.data() + i + (channels - 1) * sizeof(T), sizeof value);
      if constexpr (std::is_integral_v<T>) {
        greatest = std::max(greatest, value);
      } else {
        any |= !isEmptyDensity(value, threshold);
      }
    }
    if (any || (std::is_integral_v<T> && !isEmptyDensity(static_cast<float>(greatest), threshold))) return true;
  }
  return false;
}

bool anyNonEmpty(VoxelType type, std::span<const std::byte> voxels, float threshold) {
  switch (type) {
    case VoxelType::u8:
      return anyAbove<std::uint8_t, 1>(voxels, threshold);
    case VoxelType::rgba8:
      return anyAbove<std::uint8_t, 4>(voxels, threshold);
    case VoxelType::u16:
      return anyAbove<std::uint16_t, 1>(voxels, threshold);
    case VoxelType::f32:
      return anyAbove<float, 1>(voxels, threshold);
  }
  return false;
}

// Rows of a subblock, `row_bytes` each, from where they lie a strip's row and slice apart.
template <std::size_t row_bytes>
void copyRows(const std::byte* from, std::size_t strip_row, std::size_t strip_slice, std::size_t side, std::byte* to) {
  for (std::size_t z = 0; z < side; ++z) {
    for (std::size_t y = 0; y < side; ++y, to += row_bytes) {
      std::memcpy(to, from + z * strip_slice + y * strip_row, row_bytes);
    }
  }
}

}  // namespace

StripCutter::StripCutter(const VolumeInfo& info, std::span<const std::optional<float>> thresholds,
                         std::size_t group_bytes, Spill& spill)
    : info_(info),
      thresholds_(thresholds),
      thresholds_known_(std::ranges::all_of(thresholds, [](const auto& threshold) { return threshold.has_value(); })),
      voxel_bytes_(voxelBytes(info.type)),
      channel_bytes_(static_cast<std::size_t>(info.subblockVoxels()) * voxel_bytes_),
      subblock_bytes_(channel_bytes_ * info.channels.size()),
      group_count_(std::max<std::size_t>(1, group_bytes / subblock_bytes_)),
      spill_(spill) {}

void StripCutter::cut(const Strip& strip) {
  if (thresholds_known_ && !anyChannel([&](std::size_t channel) { return strip.channel(channel); })) return;
  const glm::ivec3 first = strip.begin / info_.subblock_side;
  for (int x = 0; x * info_.subblock_side < strip.extent.x; ++x) {
    const int begin = x * info_.subblock_side;
    const glm::ivec3 extent(std::min(info_.subblock_side, strip.extent.x - begin), strip.extent.y, strip.extent.z);
    if (keys_.size() == group_count_) flush();
    group_.resize(std::max(group_.size(), (keys_.size() + 1) * subblock_bytes_));
    bool constant = !thresholds_known_;
    for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
      gather(strip, channel, begin, extent);
      constant = constant && isConstant(strip, channel, begin, extent);
    }
    store(subblockKey(first + glm::ivec3(x, 0, 0), info_.block_side), constant);
  }
}

CutSubblocks StripCutter::take() {
  flush();
  return std::exchange(cut_, {});
}

void StripCutter::flush() {
  order_.resize(keys_.size());
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  std::ranges::sort(order_, {}, [this](std::size_t i) { return keys_[i]; });
  std::uint64_t slot = spill_.append(group_, order_);
  for (const std::size_t i : order_) cut_.records.push_back({.key = keys_[i], .slot = slot++});
  keys_.clear();
}

// Of the subblock that is looked at.
std::span<std::byte> StripCutter::subblockOf(std::size_t channel) {
  return std::span(group_).subspan(keys_.size() * subblock_bytes_ + channel * channel_bytes_, channel_bytes_);
}

// Whether some channel has a non-empty voxel in voxelsOf(channel).
template <typename VoxelsOf>
bool StripCutter::anyChannel(VoxelsOf voxelsOf) const {
  for (std::size_t channel = 0; channel < info_.channels.size(); ++channel) {
    if (anyNonEmpty(info_.type, voxelsOf(channel), *thresholds_[channel])) return true;
  }
  return false;
}

const std::byte* StripCutter::rowOf(const Strip& strip, std::size_t channel, glm::ivec3 voxel) const {
  const auto row =
      static_cast<std::size_t>(voxel.z) * static_cast<std::size_t>(strip.extent.y) + static_cast<std::size_t>(voxel.y);
  return strip.channel(channel).data() +
         (row * static_cast<std::size_t>(strip.extent.x) + static_cast<std::size_t>(voxel.x)) * voxel_bytes_;
}

// Copies a channel of the subblock that begins at `x`, zeros outside.
void StripCutter::gather(const Strip& strip, std::size_t channel, int x, glm::ivec3 extent) {
  const std::span<std::byte> out = subblockOf(channel);
  const auto side = static_cast<std::size_t>(info_.subblock_side);
  const std::size_t row_bytes = static_cast<std::size_t>(extent.x) * voxel_bytes_;
  if (extent == glm::ivec3(info_.subblock_side)) {
    const std::byte* from = rowOf(strip, channel, {x, 0, 0});
    const std::size_t strip_row = static_cast<std::size_t>(strip.extent.x) * voxel_bytes_;
    const std::size_t strip_slice = strip_row * static_cast<std::size_t>(strip.extent.y);
    if (row_bytes == 8) return copyRows<8>(from, strip_row, strip_slice, side, out.data());
    if (row_bytes == 16) return copyRows<16>(from, strip_row, strip_slice, side, out.data());
    if (row_bytes == 32) return copyRows<32>(from, strip_row, strip_slice, side, out.data());
  }
  if (extent != glm::ivec3(info_.subblock_side)) std::ranges::fill(out, std::byte{0});
  for (int z = 0; z < extent.z; ++z) {
    for (int y = 0; y < extent.y; ++y) {
      const auto to = (static_cast<std::size_t>(z) * side + static_cast<std::size_t>(y)) * side * voxel_bytes_;
      std::memcpy(out.data() + to, rowOf(strip, channel, {x, y, z}), row_bytes);
    }
  }
}

// Whether all its voxels are the same bytes.
bool StripCutter::isConstant(const Strip& strip, std::size_t channel, int x, glm::ivec3 extent) const {
  const std::byte* first = rowOf(strip, channel, {x, 0, 0});
  const std::size_t rest = static_cast<std::size_t>(extent.x - 1) * voxel_bytes_;
  for (int z = 0; z < extent.z; ++z) {
    for (int y = 0; y < extent.y; ++y) {
      // A row repeats its first voxel when it equals itself shifted by one voxel.
      const std::byte* row = rowOf(strip, channel, {x, y, z});
      if (std::memcmp(row, first, voxel_bytes_) != 0 || std::memcmp(row, row + voxel_bytes_, rest) != 0) return false;
    }
  }
  return true;
}

void StripCutter::store(std::uint64_t key, bool constant) {
  // Padding is 0 and may count as non-empty below a negative threshold; the next pass looks again.
  if (thresholds_known_ && !anyChannel([&](std::size_t channel) { return subblockOf(channel); })) return;
  if (constant) {
    cut_.records.push_back({.key = key, .slot = kConstantSlot | constantIndex()});
    return;
  }
  keys_.push_back(key);
}

// Where the constants hold the first voxel of each channel; a value that comes again and again is held once.
std::uint64_t StripCutter::constantIndex() {
  const std::size_t bytes = voxel_bytes_ * info_.channels.size();
  std::vector<std::byte>& constants = cut_.constants;
  bool repeats = !constants.empty();
  for (std::size_t channel = 0; channel < info_.channels.size() && repeats; ++channel) {
    const std::byte* last = constants.data() + constants.size() - bytes + channel * voxel_bytes_;
    repeats = std::memcmp(last, subblockOf(channel).data(), voxel_bytes_) == 0;
  }
  for (std::size_t channel = 0; channel < info_.channels.size() && !repeats; ++channel) {
    const std::span<const std::byte> first = subblockOf(channel).first(voxel_bytes_);
    constants.insert(constants.end(), first.begin(), first.end());
  }
  return constants.size() / bytes - 1;
}

}  // namespace blockwalk
