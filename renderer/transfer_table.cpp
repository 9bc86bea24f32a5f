// SPDX-License-Identifier: Apache-2.0
#include "renderer/transfer_table.h"

#include <algorithm>
#include <cmath>

namespace blockwalk {
namespace {

// Constant beyond the ends; linear between points, or as the point before.
TransferPoint evaluate(const View& view, double value) {
  const std::vector<TransferPoint>& points = view.transfer;
  const auto next = std::ranges::upper_bound(points, value, {}, &TransferPoint::value);
  if (next == points.begin()) return points.front();
  if (next == points.end()) return points.back();
  const TransferPoint& a = *std::prev(next);
  if (view.transfer_shape == TransferShape::stepped) return a;
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

bool isExact(const View& view, const VolumeInfo& info) {
  return info.type != VoxelType::f32 && view.filter == Filter::nearest &&
         (view.mode == Mode::blend || view.mode == Mode::first_hit);
}

TransferTable bakeExact(const View& view, const VolumeInfo& info, StoredRange visible) {
  TransferTable table;
  table.entries.assign(info.type == VoxelType::u8 ? 256 : 65536, glm::vec4(0));
  for (std::size_t stored = 0; stored < table.entries.size(); ++stored) {
    const auto value = static_cast<float>(stored);
    if (value < visible.lo || value > visible.hi) continue;
    table.entries[stored] = entryOf(evaluate(view, info.dataFromStored(value)), unitDistance(info));
  }
  return table;
}

// Trapezoids over the entries, which is what interpolating them linearly means.
void integrate(TransferTable& table) {
  glm::dvec4 sum(0);
  const auto density = [](const glm::vec4& entry) {
    return glm::dvec4(glm::dvec3(entry) * static_cast<double>(entry.a), entry.a);
  };
  for (std::size_t i = 0; i < table.entries.size(); ++i) {
    if (i > 0)
      sum += 0.5 / static_cast<double>(table.scale) * (density(table.entries[i - 1]) + density(table.entries[i]));
    const glm::vec4 rounded(sum);
    table.integrals.push_back(rounded);
    table.integrals.emplace_back(sum - glm::dvec4(rounded));
  }
}

}  // namespace

TransferTable bakeTransfer(const View& view, const VolumeInfo& info, const Plan& plan) {
  if (isExact(view, info)) return bakeExact(view, info, plan.range);
  // Averages and interpolations with empty voxels lie below level 0's smallest density.
  const bool mixes_empties = plan.level > 0 || view.filter == Filter::linear;
  const double least = mixes_empties ? std::min(info.density_min, emptyValue(info)) : info.density_min;
  const double lo = std::max<double>(plan.range.lo, least);
  const double hi = std::max<double>(std::min<double>(plan.range.hi, info.density_max), lo);
  const double width = hi > lo ? hi - lo : 1;
  TransferTable table;
  table.scale = static_cast<float>((kTableEntries - 1) / width);
  table.first = static_cast<float>(lo);
  table.entries.reserve(kTableEntries);
  for (int i = 0; i < kTableEntries; ++i) {
    const double stored = lo + width * i / (kTableEntries - 1);
    table.entries.push_back(entryOf(evaluate(view, info.dataFromStored(stored)), unitDistance(info)));
  }
  if (plan.needs_integrals) integrate(table);
  return table;
}

}  // namespace blockwalk
