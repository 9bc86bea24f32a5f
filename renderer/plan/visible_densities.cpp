// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/visible_densities.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "renderer/plan/density_scale.h"

namespace blockwalk {
namespace {

// Stretches of a transfer function with some opacity, data units, ascending and apart.
std::vector<DensityRange> opaqueStretches(const std::vector<TransferPoint>& points, TransferShape shape) {
  std::vector<DensityRange> stretches;
  const auto add = [&](double lo, double hi) {
    if (!stretches.empty() && stretches.back().hi >= lo) {
      stretches.back().hi = hi;
    } else {
      stretches.push_back({lo, hi});
    }
  };
  if (points.front().opacity > 0) add(-kInfinity, points.front().value);
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const bool rises = shape == TransferShape::linear && points[i + 1].opacity > 0;
    if (points[i].opacity > 0 || rises) add(points[i].value, points[i + 1].value);
  }
  if (points.back().opacity > 0) add(points.back().value, kInfinity);
  return stretches;
}

}  // namespace

std::vector<StoredRange> visibleDensities(const ResolvedView& view, const VolumeInfo& info, const ChannelPlan& drawn,
                                          float table_scale) {
  const StoredRange range = onDevice(drawn.range, info, drawn.channel);
  const bool looks_at_opacity = view.mode == Mode::blend || view.mode == Mode::first_hit;
  if (info.type == VoxelType::rgba8 || !looks_at_opacity) return {range};
  const ChannelInfo& channel = info.channels[drawn.channel];
  const int exponent = densityExponent(info, drawn.channel);
  const double margin = 2 / static_cast<double>(table_scale);
  const auto deviceOf = [&](double data) { return std::ldexp(channel.storedFromData(data), exponent); };
  std::vector<StoredRange> visible;
  for (const DensityRange& stretch : opaqueStretches(view.channels[drawn.channel].transfer, view.transfer_shape)) {
    const double lo = std::max<double>(deviceOf(stretch.lo) - margin, range.lo);
    const double hi = std::min<double>(deviceOf(stretch.hi) + margin, range.hi);
    if (!(lo <= hi)) continue;
    const StoredRange rounded{.lo = std::nextafter(static_cast<float>(lo), range.lo),
                              .hi = std::nextafter(static_cast<float>(hi), range.hi)};
    if (!visible.empty() && visible.back().hi >= rounded.lo) {
      visible.back().hi = rounded.hi;
    } else {
      visible.push_back(rounded);
    }
  }
  return visible;
}

}  // namespace blockwalk
