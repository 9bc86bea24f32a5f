// SPDX-License-Identifier: Apache-2.0
#include "volume/build/statistics.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "volume/build/summary.h"
#include "volume/error.h"

namespace blockwalk {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Four tables because a run of equal values would wait for its own last increment; eight bytes are loaded at once.
template <std::size_t stride>
void countBytes(std::span<const std::byte> bytes, std::vector<std::uint64_t>& counts) {
  std::array<std::array<std::uint64_t, 256>, 4> tables{};
  constexpr std::size_t kFirst = stride - 1;  // alpha of rgba8 is its last byte
  std::size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + i, sizeof word);
    for (std::size_t at = kFirst; at < 8; at += stride) ++tables[at / stride % 4][word >> (8 * at) & 0xff];
  }
  for (i += kFirst; i < bytes.size(); i += stride) ++tables[0][std::to_integer<std::uint8_t>(bytes[i])];
  for (const auto& table : tables) {
    for (std::size_t value = 0; value < table.size(); ++value) counts[value] += table[value];
  }
}

bool isAllZero(std::span<const std::byte> bytes) {
  return bytes.empty() ||
         (bytes[0] == std::byte{0} && std::memcmp(bytes.data(), bytes.data() + 1, bytes.size() - 1) == 0);
}

// The next greater density that the type can hold; its own greatest where there is none.
float nextDensity(VoxelType type, float density) {
  if (type != VoxelType::f32) return density + 1;
  const float next = std::nextafter(density, kInfinity);
  return std::isfinite(next) ? next : density;
}

std::array<float, kRangeMaskBins - 1> uniformCuts(double lo, double hi) {
  std::array<float, kRangeMaskBins - 1> cuts{};
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    const double part = static_cast<double>(i + 1) / kRangeMaskBins;
    cuts[i] = static_cast<float>(lo * (1 - part) + hi * part);
  }
  return cuts;
}

}  // namespace

std::optional<float> thresholdBeforeReading(const SourceInfo& source, std::size_t channel,
                                            const BuildOptions& options) {
  const SourceChannel& map = source.channels[channel];
  const auto stored = [&map](double data) { return (data - map.value_offset) / map.value_scale; };
  if (!options.empty_thresholds.empty()) {
    const double wanted = options.empty_thresholds[options.empty_thresholds.size() == 1 ? 0 : channel];
    const auto threshold = static_cast<float>(stored(wanted));
    if (!std::isfinite(threshold)) {
      failData("{}: empty threshold {} is not a finite stored density", source.name, wanted);
    }
    return threshold + 0.0f;
  }
  if (source.type == VoxelType::f32 || map.value_offset < 0) return std::nullopt;
  return static_cast<float>(stored(0)) + 0.0f;
}

std::uint16_t densityKey(VoxelType type, float density) {
  if (type != VoxelType::f32) return static_cast<std::uint16_t>(density);
  const auto bits = std::bit_cast<std::uint32_t>(density);
  return static_cast<std::uint16_t>(((bits & 0x80000000u) != 0 ? ~bits : bits | 0x80000000u) >> 16);
}

float densityOfKey(VoxelType type, std::uint16_t key) {
  if (type != VoxelType::f32) return key;
  const std::uint32_t ordered = std::uint32_t{key} << 16;
  return std::bit_cast<float>((ordered & 0x80000000u) != 0 ? ordered & 0x7fffffffu : ~ordered);
}

DensityStatistics::DensityStatistics(VoxelType type, float reference)
    : type_(type),
      reference_(reference),
      counts_(densityKeys(type)),
      least_(kInfinity),
      second_(kInfinity),
      above_reference_(kInfinity),
      greatest_(-kInfinity) {}

void DensityStatistics::add(std::span<const std::byte> voxels) {
  if (type_ != VoxelType::f32 && isAllZero(voxels)) {
    counts_[0] += voxels.size() / voxelBytes(type_);
    return;
  }
  switch (type_) {
    case VoxelType::u8:
      countBytes<1>(voxels, counts_);
      break;
    case VoxelType::rgba8:
      countBytes<4>(voxels, counts_);
      break;
    case VoxelType::u16:
      for (std::size_t i = 0; i < voxels.size(); i += 2) {
        std::uint16_t value = 0;
        std::memcpy(&value, voxels.data() + i, sizeof value);
        ++counts_[value];
      }
      break;
    case VoxelType::f32:
      addFloats(voxels);
      break;
  }
}

void DensityStatistics::add(std::span<const std::byte> voxel, std::uint64_t count) {
  if (count == 0) return;
  add(voxel);
  const float density = storedDensity(type_, voxel.data()) + 0.0f;  // -0 is 0
  (std::isfinite(density) ? counts_[densityKey(type_, density)] : nonfinite_) += count - 1;
}

void DensityStatistics::add(const DensityStatistics& other) {
  nonfinite_ += other.nonfinite_;
  for (std::size_t key = 0; key < counts_.size(); ++key) counts_[key] += other.counts_[key];
  const float least = std::min(least_, other.least_);
  float second = std::min(second_, other.second_);
  if (least_ > least) second = std::min(second, least_);
  if (other.least_ > least) second = std::min(second, other.least_);
  least_ = least;
  second_ = second;
  above_reference_ = std::min(above_reference_, other.above_reference_);
  greatest_ = std::max(greatest_, other.greatest_);
}

void DensityStatistics::addFloats(std::span<const std::byte> voxels) {
  float last = std::numeric_limits<float>::quiet_NaN();
  std::uint64_t run = 0;  // of voxels equal to `last`: backgrounds are long runs
  const auto close = [&] {
    if (run > 0) counts_[densityKey(VoxelType::f32, last)] += run;
    run = 0;
  };
  for (std::size_t i = 0; i < voxels.size(); i += sizeof(float)) {
    float value = 0;
    std::memcpy(&value, voxels.data() + i, sizeof value);
    value += 0.0f;  // -0 is 0
    if (value == last) {
      ++run;
      continue;
    }
    if (!std::isfinite(value)) {
      ++nonfinite_;
      continue;
    }
    close();
    last = value;
    run = 1;
    if (value < least_)
      second_ = std::exchange(least_, value);
    else if (value > least_ && value < second_)
      second_ = value;
    if (value > reference_ && value < above_reference_) above_reference_ = value;
    if (value > greatest_) greatest_ = value;
  }
  close();
}

float DensityStatistics::emptyThreshold(std::optional<float> known) const {
  if (known) return *known;
  float least = least_;
  if (type_ != VoxelType::f32) {
    const auto first = std::ranges::find_if(counts_, [](std::uint64_t count) { return count > 0; });
    least = static_cast<float>(first - counts_.begin());
  }
  // No voxel negative: 0 data units is the reference. All voxels may be NaN: then anything is right.
  return std::min(least, reference_);
}

void DensityStatistics::findRange(ChannelInfo& channel, std::optional<float> threshold) const {
  float greatest = greatest_;
  if (type_ != VoxelType::f32) {
    const auto counted = [](std::uint64_t count) { return count > 0; };
    const auto last = counts_.rend() - std::find_if(counts_.rbegin(), counts_.rend(), counted) - 1;
    greatest = static_cast<float>(last);
  }
  channel.empty_threshold = emptyThreshold(threshold);
  if (!(greatest > channel.empty_threshold)) return;  // all empty: density_min and density_max stay 0
  channel.density_max = greatest;
  if (type_ == VoxelType::f32) {
    channel.density_min = channel.empty_threshold == reference_ ? above_reference_ : second_;
    return;
  }
  for (std::size_t key = 0; key < counts_.size(); ++key) {
    if (counts_[key] > 0 && static_cast<float>(key) > channel.empty_threshold) {
      channel.density_min = static_cast<float>(key);
      return;
    }
  }
}

std::array<float, kRangeMaskBins - 1> DensityStatistics::quantileCuts(float threshold, float density_max) const {
  struct Bin {
    float density;
    std::uint64_t count;
  };
  std::vector<Bin> bins;
  std::uint64_t left = 0;
  for (std::size_t key = 0; key < counts_.size(); ++key) {
    const auto narrow = static_cast<std::uint16_t>(key);
    // Of a float's key that holds the threshold nobody knows which part is empty, usually nearly all; left out, its
    // other part falls into bin 0.
    const bool above =
        type_ == VoxelType::f32 ? narrow > densityKey(type_, threshold) : static_cast<float>(key) > threshold;
    if (counts_[key] == 0 || !above) continue;
    bins.push_back({densityOfKey(type_, narrow), counts_[key]});
    left += counts_[key];
  }
  std::array<float, kRangeMaskBins - 1> cuts{};
  std::size_t at = 0;
  for (std::size_t cut = 0; cut < cuts.size(); ++cut) {
    const std::uint64_t share = left / (kRangeMaskBins - cut);
    std::uint64_t taken = 0;
    // At least one key a bin, then as long as the next one brings the bin nearer to its share.
    while (at < bins.size() && (taken == 0 || taken + bins[at].count / 2 <= share)) taken += bins[at++].count;
    left -= taken;
    // Fewer than 8 values: the last bins lie above the data and stay unused.
    const float before = cut == 0 ? density_max : std::max(cuts[cut - 1], density_max);
    cuts[cut] = at < bins.size() ? bins[at].density : nextDensity(type_, before);
  }
  return cuts;
}

std::size_t DensityStatistics::distinctAbove(float threshold) const {
  std::size_t distinct = 0;
  for (std::size_t key = 0; key < counts_.size(); ++key) {
    const bool above = densityOfKey(type_, static_cast<std::uint16_t>(key)) > threshold;
    distinct += counts_[key] > 0 && above ? 1 : 0;
  }
  return distinct;
}

void DensityStatistics::describe(ChannelInfo& channel, std::optional<float> threshold, MaskBins bins) const {
  findRange(channel, threshold);
  channel.nonfinite_voxels = nonfinite_;
  const bool eight_bits = type_ == VoxelType::u8 || type_ == VoxelType::rgba8;
  channel.histogram_lo = eight_bits ? 0 : channel.density_min;
  channel.histogram_hi = eight_bits ? 255 : channel.density_max;
  const bool uniform = bins == MaskBins::uniform || (bins == MaskBins::automatic && eight_bits);
  // The density domain of 8 bits is 0..256, so that the cuts are 32, 64, ... (Derin et al. 2021, 2.3).
  channel.bin_cuts = uniform ? uniformCuts(channel.histogram_lo, eight_bits ? 256 : channel.density_max)
                             : quantileCuts(channel.empty_threshold, channel.density_max);
  if (type_ != VoxelType::f32) countNonEmpty(channel);
}

void DensityStatistics::countNonEmpty(ChannelInfo& channel) const {
  const HistogramBins bins(channel);
  channel.nonempty_voxels = 0;
  channel.histogram.fill(0);
  for (std::size_t key = 0; key < counts_.size(); ++key) {
    const auto density = static_cast<float>(key);
    if (counts_[key] == 0 || isEmptyDensity(density, channel.empty_threshold)) continue;
    channel.nonempty_voxels += counts_[key];
    channel.histogram[bins.of(density)] += counts_[key];
  }
}

}  // namespace blockwalk
