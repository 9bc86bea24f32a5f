// SPDX-License-Identifier: Apache-2.0
#include "view/label_colors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace blockwalk {
namespace {

constexpr double kLabelOpacity = 0.3;

// Hues a golden section apart: however many there are, neighbours are far from each other (Knuth 1973, 6.4). In whole
// bytes, so that the points' text form gives the same colour back.
glm::dvec3 colorOfLabel(double value) {
  constexpr double kGolden = 0.61803398874989485;
  constexpr std::array<double, 3> kSaturation{0.62, 0.85, 0.45};
  constexpr std::array<double, 3> kBrightness{0.95, 0.8, 1};
  const double hue = std::fmod(std::fabs(value) * kGolden, 1.0) * 6;
  const auto kind = static_cast<std::size_t>(std::fmod(std::fabs(value), 3));
  glm::dvec3 color;
  for (int part = 0; part < 3; ++part) {
    const double away = std::fabs(std::fmod(hue + 6 - 2.0 * part, 6.0) - 3);  // 3 at the part's own hue
    const double share = std::clamp(away - 1, 0.0, 1.0);
    const double value_part = kBrightness[kind] * (1 - kSaturation[kind] * (1 - share));
    color[part] = std::round(255 * value_part) / 255;
  }
  return color;
}

glm::dvec3 colorOf(const Color& color) { return glm::dvec3(color[0], color[1], color[2]) / 255.0; }

}  // namespace

std::vector<TransferPoint> labelTransfer(const ChannelInfo& channel) {
  const double first = std::ceil(channel.dataFromStored(static_cast<double>(channel.density_min)));
  const double last = std::max(first, std::floor(channel.dataFromStored(static_cast<double>(channel.density_max))));
  std::map<double, glm::dvec3> colors;
  for (const LabelInfo& label : channel.labels) {
    if (colors.size() == static_cast<std::size_t>(kMostLabelColors)) break;
    if (label.color && label.value >= first && label.value <= last) colors[label.value] = colorOf(*label.color);
  }
  // The others fill what is left, evenly. Counted in whole numbers: beyond 2^53 adding 1 to a label gives itself.
  const auto left = static_cast<double>(kMostLabelColors) - static_cast<double>(colors.size());
  const double step = std::max(1.0, std::ceil((last - first + 1) / std::max(left, 1.0)));
  for (int i = 0; i < kMostLabelColors && colors.size() < static_cast<std::size_t>(kMostLabelColors); ++i) {
    const double value = first + i * step;
    if (i > 0 && !(value <= last)) break;
    colors.emplace(value, colorOfLabel(value / step));
  }
  std::vector<TransferPoint> points;
  for (const auto& [value, color] : colors)
    points.push_back({.value = value, .color = color, .opacity = kLabelOpacity});
  return points;
}

}  // namespace blockwalk
