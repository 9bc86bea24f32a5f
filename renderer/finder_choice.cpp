// SPDX-License-Identifier: Apache-2.0
#include "renderer/finder_choice.h"

#include <algorithm>
#include <limits>

namespace blockwalk {

FinderTrial::FinderTrial(std::span<const Finder> candidates, int rounds)
    : candidates_(candidates.begin(), candidates.end()),
      least_(candidates.size(), std::numeric_limits<double>::infinity()),
      rounds_(rounds) {}

std::optional<Finder> FinderTrial::next() const {
  const std::size_t all = candidates_.size() * static_cast<std::size_t>(1 + rounds_);
  return measured_ < all ? std::optional(candidates_[measured_ % candidates_.size()]) : std::nullopt;
}

void FinderTrial::took(double ms) {
  const std::size_t i = measured_ % candidates_.size();
  if (measured_++ >= candidates_.size()) least_[i] = std::min(least_[i], ms);
}

Finder FinderTrial::fastest() const {
  return candidates_[static_cast<std::size_t>(std::ranges::min_element(least_) - least_.begin())];
}

Finder FinderChoices::find(std::uint64_t volume) const {
  const auto found = chosen_.find(volume);
  return found == chosen_.end() ? Finder::automatic : found->second;
}

bool FinderChoices::beginTrial(std::uint64_t volume) {
  return !chosen_.contains(volume) && trials_.insert(volume).second;
}

void FinderChoices::settle(std::uint64_t volume, Finder fastest) {
  trials_.erase(volume);
  chosen_[volume] = fastest;
}

void FinderChoices::forget(std::uint64_t volume) {
  trials_.erase(volume);
  chosen_.erase(volume);
}

}  // namespace blockwalk
