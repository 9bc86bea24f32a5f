// SPDX-License-Identifier: Apache-2.0
#include "renderer/transfer_table.h"

#include <algorithm>
#include <cmath>

namespace blockwalk {
namespace {

// Piecewise linear, constant beyond the ends.
TransferPoint evaluate(const std::vector<TransferPoint>& points, double value) {
  const auto next = std::ranges::upper_bound(points, value, {}, &TransferPoint::value);
  if (next == points.begin()) return points.front();
  if (next == points.end()) return points.back();
  const TransferPoint& a = *std::prev(next);
  const double w = (value - a.value) / (next->value - a.value);
  return {.value = value,
          .color = a.color + w * (next->color - a.color),
          .opacity = a.opacity + w * (next->opacity - a.opacity)};
}

// Extinction sigma with 1 - exp(-sigma * unit) = opacity.
glm::vec4 entryOf(const TransferPoint& point, double unit_distance) {
  const double sigma =
      point.opacity >= 1 ? kOpaqueExtinction : std::min(-std::log1p(-point.opacity), kOpaqueExtinction);
  return {glm::vec3(point.color), static_cast<float>(sigma / unit_distance)};
}

}  // namespace

TransferTable bakeTransfer(const View& view, const VolumeInfo& info, StoredRange visible, int level) {
  const double unit = unitDistance(info);
  TransferTable table;
  if (info.type != VoxelType::f32) {
    const int count = info.type == VoxelType::u8 ? 256 : 65536;
    table.entries.assign(static_cast<std::size_t>(count), glm::vec4(0));
    for (int stored = 0; stored < count; ++stored) {
      const auto value = static_cast<float>(stored);
      if (value < visible.lo || value > visible.hi) continue;
      table.entries[static_cast<std::size_t>(stored)] =
          entryOf(evaluate(view.transfer, info.dataFromStored(stored)), unit);
    }
    return table;
  }
  // Coarser levels hold averages with empty voxels, below level 0's smallest density.
  const double least = level == 0 ? info.density_min : std::min(info.density_min, emptyValue(info));
  const double lo = std::max<double>(visible.lo, least);
  const double hi = std::max<double>(std::min<double>(visible.hi, info.density_max), lo);
  const double width = hi > lo ? hi - lo : 1;
  table.scale = static_cast<float>((kFloatTableEntries - 1) / width);
  table.offset = static_cast<float>(-lo * (kFloatTableEntries - 1) / width);
  table.entries.resize(kFloatTableEntries);
  for (int i = 0; i < kFloatTableEntries; ++i) {
    const double stored = lo + width * i / (kFloatTableEntries - 1);
    table.entries[static_cast<std::size_t>(i)] = entryOf(evaluate(view.transfer, info.dataFromStored(stored)), unit);
  }
  return table;
}

}  // namespace blockwalk
