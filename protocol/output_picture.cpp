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

std::uint32_t costColor(double cost) {
  constexpr double kLargestLog = 14;
  static const std::array<glm::dvec3, 5> kStops = {glm::dvec3(0), glm::dvec3(0.34, 0.06, 0.43),
                                                   glm::dvec3(0.86, 0.25, 0.25), glm::dvec3(0.99, 0.65, 0.12),
                                                   glm::dvec3(0.99, 1.0, 0.85)};
  // Stops at logarithms 0, 5, 8, 11 and 14.
  const double position = std::min(std::log2(1 + cost), kLargestLog);
  const double stop = position < 5 ? position / 5 : 1 + (position - 5) / 3;
  const auto low = std::min(static_cast<std::size_t>(stop), kStops.size() - 2);
  return packed(glm::mix(kStops[low], kStops[low + 1], stop - static_cast<double>(low)));
}

}  // namespace

std::vector<std::uint16_t> depthPicture(const Frame& frame) {
  BLOCKWALK_CHECK(frame.output == Output::depth, ==, true);
  std::vector<std::uint16_t> picture(frame.values.size());
  std::ranges::transform(frame.values, picture.begin(), [&](float depth) -> std::uint16_t {
    if (std::isinf(depth)) return 0;
    const double share = shareOf(static_cast<double>(depth), frame.values_min.x, frame.values_max.x);
    return static_cast<std::uint16_t>(1 + std::lround(65534 * share));
  });
  return picture;
}

std::vector<std::uint32_t> outputPicture(const Frame& frame) {
  std::vector<std::uint32_t> picture(static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height));
  if (frame.output == Output::depth) {
    std::ranges::transform(depthPicture(frame), picture.begin(),
                           [](std::uint32_t depth) { return 0xff000000u | (depth >> 8) * 0x010101u; });
  } else if (frame.output == Output::position) {
    for (std::size_t i = 0; i < picture.size(); ++i) picture[i] = positionColor(frame, i);
  } else {
    BLOCKWALK_CHECK(frame.output == Output::cost, ==, true);
    std::ranges::transform(frame.values, picture.begin(), [](float cost) { return costColor(cost); });
  }
  return picture;
}

}  // namespace blockwalk
