// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace blockwalk {

// How often a time was how long, as Prometheus counts it: the buckets' bounds grow by two and a half.
class TimeHistogram {
 public:
  static constexpr std::array<double, 12> kBounds_s = {0.001, 0.0025, 0.005, 0.01, 0.025, 0.05,
                                                       0.1,   0.25,   0.5,   1,    2.5,   10};

  void add(double seconds) {
    std::size_t bucket = 0;
    while (bucket < kBounds_s.size() && seconds > kBounds_s[bucket]) ++bucket;
    ++counts_[bucket];
    sum_s_ += seconds;
  }
  // Of times up to the bound of this number; after the last: all.
  std::uint64_t upTo(std::size_t bound) const {
    std::uint64_t count = 0;
    for (std::size_t i = 0; i <= bound && i < counts_.size(); ++i) count += counts_[i];
    return count;
  }
  std::uint64_t count() const { return upTo(kBounds_s.size()); }
  double sum() const { return sum_s_; }

 private:
  std::array<std::uint64_t, kBounds_s.size() + 1> counts_{};
  double sum_s_ = 0;
};

}  // namespace blockwalk
