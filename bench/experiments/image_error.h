// SPDX-License-Identifier: Apache-2.0
// How far a picture is from the truth.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tests/reference/reference.h"

namespace blockwalk::bench {

// Colours of 3 channels in 8-bit steps, 0..255, whole or not; row 0 at the top.
struct ColorImage {
  int width = 0;
  int height = 0;
  std::vector<std::array<double, 3>> pixels{};
};

// Of straight rgba8, red lowest, over an opaque background.
ColorImage colorsOf(std::span<const std::uint32_t> pixels, int width, int height);
// Not rounded.
ColorImage colorsOf(const reference::Image& image);
// Every channel to the nearest whole step.
ColorImage roundedColors(const ColorImage& image);

struct ImageError {
  double rmse = 0;     // of all colour channels, 8-bit steps
  double largest = 0;  // 8-bit steps
  double psnr = 0;     // dB, peak 255
  double ssim = 0;     // structural similarity of luma (Wang et al. 2004: Gaussian window of 11 pixels, sigma 1.5)
};

// Of images of one size.
ImageError imageError(const ColorImage& image, const ColorImage& truth);

}  // namespace blockwalk::bench
