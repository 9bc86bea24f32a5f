// SPDX-License-Identifier: Apache-2.0
// What the finder `auto` means for a volume on a device is measured, once.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "view/resolved_view.h"

namespace blockwalk {

// Of a probe's picture: a few thousand rays.
constexpr int kProbeSide = 64;
constexpr int kProbeRounds = 3;

// The candidates take turns, and each is measured once before that to no account: that compiles and makes resident.
class FinderTrial {
 public:
  // There is at least one candidate.
  FinderTrial(std::span<const Finder> candidates, int rounds);

  // Which to measure next; none once all rounds are done.
  std::optional<Finder> next() const;
  void took(double ms);
  // The candidate whose least time in a round is the least; of equals the first.
  Finder fastest() const;

 private:
  std::vector<Finder> candidates_;
  std::vector<double> least_;
  int rounds_;
  std::size_t measured_ = 0;
};

// What was found of each volume, by its serial number.
class FinderChoices {
 public:
  Finder find(std::uint64_t volume) const;  // automatic: it was not measured
  // False where that is known, or another frame is about to: then whatever is there serves.
  bool beginTrial(std::uint64_t volume);
  void abandonTrial(std::uint64_t volume) { trials_.erase(volume); }
  void settle(std::uint64_t volume, Finder fastest);
  void forget(std::uint64_t volume);

 private:
  std::map<std::uint64_t, Finder> chosen_;
  std::set<std::uint64_t> trials_;
};

}  // namespace blockwalk
