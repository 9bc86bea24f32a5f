// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/classify.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/reference/quadrature.h"
#include "volume/error.h"

namespace blockwalk::reference {
namespace {

// Integrals of -ln q and of -q ln q from 0 to q.
double integralOfLog(double q) { return q > 0 ? q - q * std::log(q) : 0; }
double integralOfMoment(double q) { return q > 0 ? q * q / 4 - q * q / 2 * std::log(q) : 0; }

// Means over u = 0..1 of sigma and u sigma where opacity goes straight from `opacity0` to `opacity1`.
struct Moments {
  double mean = 0;
  double first = 0;
};

Moments momentsOf(double opacity0, double opacity1) {
  const double q0 = 1 - opacity0, q1 = 1 - opacity1;
  if (q0 <= 0 && q1 <= 0) return {.mean = kOpaqueExtinction, .first = kOpaqueExtinction / 2};
  Moments moments;
  if (q1 <= 2 * q0 && q0 <= 2 * q1) {
    // Far from the logarithm's pole: Gauss's rule is exact to the last bit, the closed form would cancel.
    for (const QuadratureNode& node : gaussRule()) {
      const double sigma = extinctionOf(opacity0 + node.x * (opacity1 - opacity0));
      moments.mean += node.weight * sigma;
      moments.first += node.weight * sigma * node.x;
    }
    return moments;
  }
  moments.mean = (integralOfLog(q1) - integralOfLog(q0)) / (q1 - q0);
  const double mean_q = (integralOfMoment(q1) - integralOfMoment(q0)) / (q1 - q0);
  moments.first = (mean_q - q0 * moments.mean) / (q1 - q0);
  return moments;
}

}  // namespace

void sortUnique(std::vector<double>& values) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  std::ranges::sort(values);
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

double extinctionOf(double opacity) { return opacity >= 1 ? kOpaqueExtinction : -std::log1p(-opacity); }

TransferPoint TransferPiece::at(double value) const {
  const double away = value - at_value.value;
  return {.value = value,
          .color = at_value.color + away * color_slope,
          .opacity = std::clamp(at_value.opacity + away * opacity_slope, 0.0, 1.0)};
}

TransferPiece transferPieceAt(const std::vector<TransferPoint>& transfer, double value, TransferShape shape) {
  BLOCKWALK_CHECK(transfer.size(), >, std::size_t{0});
  const auto constant = [&](const TransferPoint& point) {
    return TransferPiece{.at_value = {.value = value, .color = point.color, .opacity = point.opacity}};
  };
  const auto above =
      std::find_if(transfer.begin(), transfer.end(), [&](const TransferPoint& point) { return point.value > value; });
  if (above == transfer.begin()) return constant(transfer.front());
  if (above == transfer.end()) return constant(transfer.back());
  const TransferPoint& below = *(above - 1);
  if (shape == TransferShape::stepped) return constant(below);
  const double width = above->value - below.value;
  const double s = (value - below.value) / width;
  return {.at_value = {.value = value,
                       .color = below.color + s * (above->color - below.color),
                       .opacity = below.opacity + s * (above->opacity - below.opacity)},
          .color_slope = (above->color - below.color) / width,
          .opacity_slope = (above->opacity - below.opacity) / width};
}

Classifier::Classifier(const DenseVolume& volume_, const View& view_)
    : volume(volume_), view(view_), look(view_.channels[volume_.channel]) {
  range = look.range.value();
  if (view.mode == Mode::iso) range = {.lo = view.iso.value_or((range.lo + range.hi) / 2), .hi = kInfinity};
  // An iso value is meant as it stands.
  const bool opens_below = view.mode != Mode::iso && volume.level0_extent && range.lo <= volume.level0_extent->min;
  if (opens_below) range.lo = -kInfinity;
  if (volume.level0_extent && range.hi >= volume.level0_extent->max) range.hi = kInfinity;
  needs_opacity = volume.type != VoxelType::rgba8 && (view.mode == Mode::blend || view.mode == Mode::first_hit);
}

bool Classifier::isVisible(double density) const {
  if (!(density > static_cast<double>(volume.empty_threshold))) return false;
  const double data = dataOf(density);
  if (data < range.lo || data > range.hi) return false;
  return !needs_opacity || transferPieceAt(look.transfer, data, view.transfer_shape).at_value.opacity > 0;
}

double Classifier::shareOf(double density) const {
  const DensityRange given = look.range.value();
  if (given.hi == given.lo) return 1;
  return std::clamp((dataOf(density) - given.lo) / (given.hi - given.lo), 0.0, 1.0);
}

double Classifier::densityAt(double share) const {
  const DensityRange given = look.range.value();
  return storedOf(given.lo + share * (given.hi - given.lo));
}

Material Classifier::materialAt(const glm::dvec4& field) const {
  if (volume.type == VoxelType::rgba8) {
    return {.color = field.w > 0 ? glm::dvec3(field) / field.w : glm::dvec3(0),
            .sigma = view.extinction * field.w / 255};
  }
  const TransferPoint point = transferPieceAt(look.transfer, dataOf(field.w), view.transfer_shape).at_value;
  return {.color = point.color, .sigma = extinctionOf(point.opacity)};
}

Material Classifier::meanMaterial(double f, double g) const {
  if (f == g) return isVisible(f) ? materialAt({0, 0, 0, f}) : Material{};
  const double low = std::min(f, g), high = std::max(f, g);
  std::vector<double> ends{low, high};
  for (double kink : kinks()) {
    if (kink > low && kink < high) ends.push_back(kink);
  }
  std::ranges::sort(ends);
  Material mean;
  glm::dvec3 light(0);
  for (std::size_t i = 1; i < ends.size(); ++i) {
    const double middle = ends[i - 1] + (ends[i] - ends[i - 1]) / 2;
    if (!isVisible(middle)) continue;
    const TransferPiece piece = transferPieceAt(look.transfer, dataOf(middle), view.transfer_shape);
    const TransferPoint a = piece.at(dataOf(ends[i - 1])), b = piece.at(dataOf(ends[i]));
    const double share = (ends[i] - ends[i - 1]) / (high - low);
    const Moments moments = momentsOf(a.opacity, b.opacity);
    mean.sigma += share * moments.mean;
    light += share * (moments.mean * a.color + moments.first * (b.color - a.color));
  }
  if (mean.sigma > 0) mean.color = light / mean.sigma;
  return mean;
}

std::vector<double> Classifier::jumps() const {
  std::vector<double> values{static_cast<double>(volume.empty_threshold), storedOf(range.lo), storedOf(range.hi)};
  if (view.mode == Mode::blend || view.mode == Mode::first_hit) {
    for (double value : transferJumps()) values.push_back(value);
  }
  sortUnique(values);
  return values;
}

std::vector<double> Classifier::transferJumps() const {
  std::vector<double> values;
  for (std::size_t i = 0; volume.type != VoxelType::rgba8 && i < look.transfer.size(); ++i) {
    const TransferPoint& point = look.transfer[i];
    const bool appears = view.mode == Mode::first_hit && point.opacity == 0;
    const bool same_as_before = i > 0 && point.value == look.transfer[i - 1].value;
    if (view.transfer_shape == TransferShape::stepped || appears || point.opacity >= 1 || same_as_before) {
      values.push_back(storedOf(point.value));
    }
  }
  sortUnique(values);
  return values;
}

std::vector<double> Classifier::kinks() const {
  std::vector<double> values{static_cast<double>(volume.empty_threshold), storedOf(range.lo), storedOf(range.hi)};
  if (volume.type != VoxelType::rgba8) {
    for (const TransferPoint& point : look.transfer) values.push_back(storedOf(point.value));
  }
  sortUnique(values);
  return values;
}

}  // namespace blockwalk::reference
