// SPDX-License-Identifier: Apache-2.0
#include "renderer/finder_probe.h"

#include <algorithm>
#include <limits>
#include <vector>

namespace blockwalk {

Finder fastestFinder(std::span<const Finder> candidates, int rounds, const std::function<double(Finder)>& measure) {
  std::vector<double> least(candidates.size(), std::numeric_limits<double>::infinity());
  for (Finder candidate : candidates) measure(candidate);
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < candidates.size(); ++i) least[i] = std::min(least[i], measure(candidates[i]));
  }
  return candidates[static_cast<std::size_t>(std::ranges::min_element(least) - least.begin())];
}

}  // namespace blockwalk
