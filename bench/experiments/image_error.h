// SPDX-License-Identifier: Apache-2.0
// How far a picture is from the truth.
#pragma once

#include <cstdint>
#include <span>

#include "tests/reference/reference.h"

namespace blockwalk::bench {

struct ImageError {
  double rmse = 0;     // of all colour channels, 8-bit steps
  double largest = 0;  // 8-bit steps
  double psnr = 0;     // dB, peak 255
  double ssim = 0;     // structural similarity of luma (Wang et al. 2004: Gaussian window of 11 pixels, sigma 1.5)
};

// `pixels` is straight rgba8, red lowest, over an opaque background; the truth is not rounded.
ImageError imageError(std::span<const std::uint32_t> pixels, const reference::Image& truth);

}  // namespace blockwalk::bench
