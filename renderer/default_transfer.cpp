// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include "renderer/view.h"

namespace blockwalk {
namespace {

// The histogram bin that best separates background from body: the threshold of largest variance between the two classes
// (Otsu 1979).
int otsuBin(const std::array<std::uint64_t, kHistogramBins>& counts) {
  double total = 0;
  double moment = 0;
  for (int i = 0; i < kHistogramBins; ++i) {
    total += static_cast<double>(counts[static_cast<std::size_t>(i)]);
    moment += i * static_cast<double>(counts[static_cast<std::size_t>(i)]);
  }
  double below = 0;
  double moment_below = 0;
  double best = -1;
  int bin = 0;
  for (int i = 0; i < kHistogramBins - 1; ++i) {
    below += static_cast<double>(counts[static_cast<std::size_t>(i)]);
    moment_below += i * static_cast<double>(counts[static_cast<std::size_t>(i)]);
    if (below <= 0 || below >= total) continue;
    const double difference = moment_below / below - (moment - moment_below) / (total - below);
    const double variance = below * (total - below) * difference * difference;
    if (variance > best) {
      best = variance;
      bin = i;
    }
  }
  return bin;
}

int percentileBin(const std::array<std::uint64_t, kHistogramBins>& counts, double share) {
  double total = 0;
  for (const auto count : counts) total += static_cast<double>(count);
  double below = 0;
  for (int i = 0; i < kHistogramBins; ++i) {
    below += static_cast<double>(counts[static_cast<std::size_t>(i)]);
    if (below >= share * total) return i;
  }
  return kHistogramBins - 1;
}

}  // namespace

std::vector<TransferPoint> defaultTransfer(const VolumeInfo& info) {
  const double width = (static_cast<double>(info.histogram_hi) - info.histogram_lo) / kHistogramBins;
  const auto at = [&](double bin) { return info.dataFromStored(info.histogram_lo + width * bin); };
  const double first = at(otsuBin(info.histogram) * 0.6);
  const double middle = at(otsuBin(info.histogram) + 1.0);
  const double last = at(percentileBin(info.histogram, 0.998) + 1.0);
  const glm::dvec3 dark(0.36, 0.11, 0.06);
  const glm::dvec3 warm(0.86, 0.55, 0.33);
  const glm::dvec3 light(1.0, 0.97, 0.90);
  if (!(first < middle && middle < last) || info.density_min == info.density_max) {
    // One value, a mask: thin enough to see into, whatever its size.
    const int least = std::min({info.dims.x, info.dims.y, info.dims.z});
    return {{.value = info.dataFromStored(info.density_min), .color = warm, .opacity = std::min(0.3, 4.0 / least)}};
  }
  return {{.value = first, .color = dark, .opacity = 0},
          {.value = middle, .color = warm, .opacity = 0.06},
          {.value = last, .color = light, .opacity = 0.4}};
}

}  // namespace blockwalk
