// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/transfer_table.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "renderer/plan/density_scale.h"

namespace blockwalk {
namespace {

constexpr double kLargestScale = 3e38;

struct TransferFunction {
  const std::vector<TransferPoint>& points;
  TransferShape shape;
  double unit_distance;
};

// Constant beyond the ends; linear between points, or as the point before.
TransferPoint evaluate(const TransferFunction& transfer, double value) {
  const std::vector<TransferPoint>& points = transfer.points;
  const auto next = std::ranges::upper_bound(points, value, {}, &TransferPoint::value);
  if (next == points.begin()) return points.front();
  if (next == points.end()) return points.back();
  const TransferPoint& a = *std::prev(next);
  if (transfer.shape == TransferShape::stepped) return a;
  const double w = (value - a.value) / (next->value - a.value);
  return {.value = value,
          .color = a.color + w * (next->color - a.color),
          .opacity = a.opacity + w * (next->opacity - a.opacity)};
}

// Extinction sigma with 1 - exp(-sigma * unit) = opacity.
std::uint64_t entryOf(const TransferPoint& point, double unit_distance) {
  const double sigma =
      point.opacity >= 1 ? kOpaqueExtinction : std::min(-std::log1p(-point.opacity), kOpaqueExtinction);
  const auto extinction = static_cast<float>(std::min(sigma / unit_distance, 1e35));
  const auto level = [](double value, double last) {
    return static_cast<std::uint64_t>(std::lround(std::clamp(value, 0.0, 1.0) * last));
  };
  const std::uint64_t color =
      level(point.color.r, 2047) << 21 | level(point.color.g, 2047) << 10 | level(point.color.b, 1023);
  return color << 32 | std::bit_cast<std::uint32_t>(extinction);
}

TransferTable bakeExact(const TransferFunction& transfer, VoxelType type, const ChannelInfo& channel,
                        StoredRange visible) {
  TransferTable table;
  table.entries.assign(type == VoxelType::u8 ? 256 : 65536, 0);
  for (std::size_t stored = 0; stored < table.entries.size(); ++stored) {
    const auto value = static_cast<float>(stored);
    if (value < visible.lo || value > visible.hi) continue;
    table.entries[stored] = entryOf(evaluate(transfer, channel.dataFromStored(value)), transfer.unit_distance);
  }
  return table;
}

// Integrals over u = 0..1 of sigma = -ln q and of u sigma, q = 1 - opacity straight from q0 to q1.
glm::dvec2 momentsOfLog(double q0, double q1) {
  const double slope = q1 - q0;
  if (std::abs(slope) < 0.25 * std::max(q0, q1)) {
    // The closed form would cancel; Gauss and Legendre's rule of four nodes is right to 1e-9 here.
    constexpr double kNode[] = {0.069431844202973712, 0.330009478207571868};
    constexpr double kWeight[] = {0.173927422568726929, 0.326072577431273071};
    glm::dvec2 sum(0);
    for (int i = 0; i < 4; ++i) {
      const double u = i < 2 ? kNode[i] : 1 - kNode[i - 2];
      sum += kWeight[i % 2] * std::min(-std::log(q0 + u * slope), kOpaqueExtinction) * glm::dvec2(1, u);
    }
    return sum;
  }
  const auto logOf = [](double q) { return q > 0 ? std::log(q) : 0; };
  const auto primitive = [&](double q) { return q - q * logOf(q); };
  const auto primitive_of_moment = [&](double q) { return q * q * (0.25 - 0.5 * logOf(q)); };
  const double mean = (primitive(q1) - primitive(q0)) / slope;
  const double moment = (primitive_of_moment(q1) - primitive_of_moment(q0)) / slope;
  return {mean, (moment - q0 * mean) / slope};
}

// Integral over value from `lo` to `hi` of (extinction x colour, extinction) a unit distance; no point lies between.
glm::dvec4 integralBetween(const TransferFunction& transfer, double lo, double hi) {
  const TransferPoint a = evaluate(transfer, lo);
  const TransferPoint b = transfer.shape == TransferShape::stepped ? a : evaluate(transfer, hi);
  const glm::dvec2 moments = a.opacity >= 1 && b.opacity >= 1 ? kOpaqueExtinction * glm::dvec2(1, 0.5)
                                                              : momentsOfLog(1 - a.opacity, 1 - b.opacity);
  return (hi - lo) * glm::dvec4(moments.x * a.color + moments.y * (b.color - a.color), moments.x);
}

// The exact integral up to each entry, so that what is narrower than an entry counts for what it is. `value(i)` is the
// entry's, in data units; one data unit is `device_per_data` on the device.
template <typename ValueOf>
void integrate(const TransferFunction& transfer, ValueOf value, double device_per_data, TransferTable& table) {
  glm::dvec4 sum(0);
  auto point = transfer.points.begin();
  for (int i = 0; i < kTableEntries; ++i) {
    double at = i > 0 ? value(i - 1) : value(0);
    while (point != transfer.points.end() && point->value <= at) ++point;
    for (; point != transfer.points.end() && point->value < value(i); ++point) {
      sum += integralBetween(transfer, at, point->value);
      at = point->value;
    }
    sum += integralBetween(transfer, at, value(i));
    const glm::dvec4 integral = sum * (device_per_data / transfer.unit_distance);
    const glm::vec4 rounded(integral);
    table.integrals.push_back(rounded);
    table.integrals.emplace_back(integral - glm::dvec4(rounded));
  }
}

// What the entries of a table that is not exact run over, stored units.
struct Extent {
  double lo = 0;
  double width = 1;
  int exponent = 0;  // of densities on the device
};

Extent extentOf(const TableRecipe& recipe, const VolumeInfo& info, std::size_t number) {
  const ChannelInfo& channel = info.channels[number];
  const double least =
      recipe.mixes_empties ? std::min(channel.density_min, emptyValue(info.type, channel)) : channel.density_min;
  const double lo = std::min(std::max<double>(recipe.range.lo, least), recipe.reaches);
  const double hi = std::max<double>(std::min<double>(recipe.range.hi, channel.density_max), lo);
  const int exponent = densityExponent(info, number);
  // A narrower table would have a scale that is no float; one entry more than enough for what is a float is left.
  const double least_width = std::ldexp((kTableEntries - 1) / kLargestScale, -exponent);
  return {.lo = lo, .width = std::max(hi > lo ? hi - lo : 1, least_width), .exponent = exponent};
}

}  // namespace

TableSpan tableSpan(const TableRecipe& recipe, const VolumeInfo& info, std::size_t number) {
  if (recipe.exact) return {};
  const Extent extent = extentOf(recipe, info, number);
  return {.scale = static_cast<float>(std::ldexp((kTableEntries - 1) / extent.width, -extent.exponent)),
          .first = static_cast<float>(std::ldexp(extent.lo, extent.exponent))};
}

TransferTable bakeTransfer(const TableRecipe& recipe, const VolumeInfo& info, std::size_t number) {
  const ChannelInfo& channel = info.channels[number];
  const TransferFunction transfer{
      .points = recipe.transfer, .shape = recipe.shape, .unit_distance = unitDistance(info)};
  if (recipe.exact) return bakeExact(transfer, info.type, channel, recipe.range);
  const auto [lo, width, exponent] = extentOf(recipe, info, number);
  const TableSpan span = tableSpan(recipe, info, number);
  TransferTable table;
  table.scale = span.scale;
  table.first = span.first;
  table.entries.reserve(kTableEntries);
  const auto value = [&, lo = lo, width = width](int i) {
    return channel.dataFromStored(lo + width * i / (kTableEntries - 1));
  };
  for (int i = 0; i < kTableEntries; ++i)
    table.entries.push_back(entryOf(evaluate(transfer, value(i)), transfer.unit_distance));
  if (recipe.integrals) integrate(transfer, value, std::ldexp(1 / channel.value_scale, exponent), table);
  return table;
}

}  // namespace blockwalk
