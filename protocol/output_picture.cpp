// SPDX-License-Identifier: Apache-2.0
#include "protocol/output_picture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "volume/error.h"

namespace blockwalk {
namespace {

// Where `value` lies between the ends, 0..1; a box of no extent has all at its start.
double shareOf(double value, double lo, double hi) {
  return hi > lo ? std::clamp((value - lo) / (hi - lo), 0.0, 1.0) : 0.0;
}

std::uint32_t packed(const glm::dvec3& color) {
  std::uint32_t pixel = 0xff000000u;
  for (int c = 0; c < 3; ++c) pixel |= static_cast<std::uint32_t>(std::lround(255 * color[c])) << (8 * c);
  return pixel;
}

std::uint32_t positionColor(const Frame& frame, std::size_t pixel) {
  glm::dvec3 color;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto value = static_cast<double>(frame.values[3 * pixel + axis]);
    if (std::isnan(value)) return 0;
    const int a = static_cast<int>(axis);
    color[a] = shareOf(value, frame.values_min[a], frame.values_max[a]);
  }
  return packed(color);
}

// Of a count whose log2(1 + count) is at `stops`.
std::uint32_t heatColor(double count, const std::array<double, 5>& stops) {
  static const std::array<glm::dvec3, 5> kColors = {glm::dvec3(0), glm::dvec3(0.34, 0.06, 0.43),
                                                    glm::dvec3(0.86, 0.25, 0.25), glm::dvec3(0.99, 0.65, 0.12),
                                                    glm::dvec3(0.99, 1.0, 0.85)};
  const double logarithm = std::log2(1 + count);
  std::size_t low = 0;
  while (low + 2 < stops.size() && logarithm >= stops[low + 1]) ++low;
  return packed(glm::mix(kColors[low], kColors[low + 1], shareOf(logarithm, stops[low], stops[low + 1])));
}

constexpr std::array<double, 5> kCostStops = {0, 5, 8, 11, 14};
constexpr std::array<double, 5> kQueryStops = {0, 2, 4, 6, 8};

}  // namespace

bool isGrey(Output output) { return output == Output::depth || output == Output::value; }

std::vector<std::uint16_t> greyPicture(const Frame& frame) {
  BLOCKWALK_CHECK(isGrey(frame.output), ==, true);
  std::vector<std::uint16_t> picture(frame.values.size());
  std::ranges::transform(frame.values, picture.begin(), [&](float number) -> std::uint16_t {
    if (!std::isfinite(number)) return 0;
    const double share = shareOf(static_cast<double>(number), frame.values_min.x, frame.values_max.x);
    return static_cast<std::uint16_t>(1 + std::lround(65534 * share));
  });
  return picture;
}

std::vector<std::uint32_t> outputPicture(const Frame& frame) {
  std::vector<std::uint32_t> picture(static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height));
  if (isGrey(frame.output)) {
    std::ranges::transform(greyPicture(frame), picture.begin(),
                           [](std::uint32_t grey) { return 0xff000000u | (grey >> 8) * 0x010101u; });
  } else if (frame.output == Output::position) {
    for (std::size_t i = 0; i < picture.size(); ++i) picture[i] = positionColor(frame, i);
  } else {
    const bool cost = frame.output == Output::cost;
    BLOCKWALK_CHECK(cost || frame.output == Output::queries, ==, true);
    std::ranges::transform(frame.values, picture.begin(),
                           [&](float count) { return heatColor(count, cost ? kCostStops : kQueryStops); });
  }
  return picture;
}

}  // namespace blockwalk
