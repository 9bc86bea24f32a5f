// SPDX-License-Identifier: Apache-2.0
// What a slab's voxels come to in one pixel (SliceReduce).
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "volume/slice/slice.h"

namespace blockwalk {

// `weight` is above 0.
class ScalarSum {
 public:
  void add(SliceReduce reduce, double value, double weight) {
    if (!std::isfinite(value)) return;
    switch (reduce) {
      case SliceReduce::max:
        if (weight_ == 0 || value > value_) value_ = value;
        break;
      case SliceReduce::min:
        if (weight_ == 0 || value < value_) value_ = value;
        break;
      case SliceReduce::mean:
        value_ += weight * value;
        break;
    }
    weight_ += weight;
  }
  float result(SliceReduce reduce) const {
    if (weight_ == 0) return std::numeric_limits<float>::quiet_NaN();
    return static_cast<float>(reduce == SliceReduce::mean ? value_ / weight_ : value_);
  }

 private:
  double value_ = 0;
  double weight_ = 0;
};

// Of red, green and blue, straight, each with its opacity: 0..255. A mean is taken of them premultiplied.
class ColorSum {
 public:
  void add(SliceReduce reduce, const std::array<double, 4>& color, double weight) {
    const double opacity = color[3];
    if (reduce == SliceReduce::mean) {
      for (std::size_t i = 0; i < 3; ++i) parts_[i] += weight * opacity * color[i];
      parts_[3] += weight * opacity;
    } else if (weight_ == 0 || (reduce == SliceReduce::max ? opacity > parts_[3] : opacity < parts_[3])) {
      parts_ = color;
    }
    weight_ += weight;
  }
  std::uint32_t result(SliceReduce reduce) const {
    if (weight_ == 0) return 0;
    std::array<double, 4> color = parts_;
    if (reduce == SliceReduce::mean) {
      for (std::size_t i = 0; i < 3; ++i) color[i] = parts_[3] > 0 ? parts_[i] / parts_[3] : 0;
      color[3] = parts_[3] / weight_;
    }
    std::uint32_t rgba = 0;
    for (std::size_t i = 0; i < 4; ++i) rgba |= static_cast<std::uint32_t>(std::lround(color[i])) << (8 * i);
    return rgba;
  }

 private:
  std::array<double, 4> parts_{};
  double weight_ = 0;
};

inline std::array<double, 4> partsOf(std::uint32_t rgba) {
  return {static_cast<double>(rgba & 255u), static_cast<double>(rgba >> 8 & 255u),
          static_cast<double>(rgba >> 16 & 255u), static_cast<double>(rgba >> 24)};
}

}  // namespace blockwalk
