// SPDX-License-Identifier: Apache-2.0
#include "volume/import/value_offset.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

namespace blockwalk {
namespace {

// Data values, as far as they are finite.
struct ValueRange {
  double lo = std::numeric_limits<double>::infinity();
  double hi = -std::numeric_limits<double>::infinity();

  void add(const SourceChannel& channel, std::span<const std::byte> floats) {
    for (std::size_t i = 0; i < floats.size(); i += sizeof(float)) {
      float stored = 0;
      std::memcpy(&stored, &floats[i], sizeof stored);
      if (!std::isfinite(stored)) continue;
      const double value = channel.value_offset + channel.value_scale * static_cast<double>(stored);
      lo = std::min(lo, value);
      hi = std::max(hi, value);
    }
  }
  // How many times nearer to 0 the values come by taking the middle off. Only falls as the range grows.
  double gain() const { return std::max(std::fabs(lo), std::fabs(hi)) / (0.5 * (hi - lo)); }
};

constexpr double kLeastGain = 4;

}  // namespace

std::optional<double> offsetThatKeeps(Source& source) {
  const SourceInfo& info = source.info();
  // Where nothing is stored it is 0 nearly always, and then there is nothing to gain.
  if (!info.may_round || !info.blank.empty()) return std::nullopt;
  ValueRange range;
  std::vector<std::byte> rows;
  for (int z = 0; z < info.dims.z; ++z) {
    constexpr int kRows = 64;
    for (int y = 0; y < info.dims.y; y += kRows) {
      const int count = std::min(kRows, info.dims.y - y);
      const std::size_t plane = channelRowBytes(info) * static_cast<std::size_t>(count);
      rows.resize(plane * info.channels.size());
      source.readRows(z, y, count, rows);
      for (std::size_t i = 0; i < info.channels.size(); ++i) {
        range.add(info.channels[i], std::span(rows).subspan(i * plane, plane));
      }
      if (range.lo < range.hi && range.gain() < kLeastGain) return std::nullopt;
    }
  }
  double rounding = 0;
  for (std::size_t i = 0; i < info.channels.size(); ++i) {
    rounding = std::max(rounding, source.conversion(i).largest_rounding);
  }
  if (rounding == 0 || !(range.lo <= range.hi)) return std::nullopt;
  // In samples: before the source's own map of values.
  const SourceChannel& channel = info.channels[0];
  return std::round((range.lo + 0.5 * (range.hi - range.lo) - channel.value_offset) / channel.value_scale);
}

}  // namespace blockwalk
