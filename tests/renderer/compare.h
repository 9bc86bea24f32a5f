// SPDX-License-Identifier: Apache-2.0
// How far images, hits and block counts are apart, and a sentence about where it is worst.
#pragma once

#include <array>
#include <string>

#include "renderer/renderer.h"
#include "tests/reference/reference.h"

namespace blockwalk::test {

// Rays nearer than this to an edge, or in a plane of faces, may cross other cells by rounding alone; in voxels.
constexpr double kNearEdge = 1e-3;

// Samples this near to where what is seen jumps may fall to either side: a float holds a density to about a tenth of
// it. Of the contrast.
constexpr double kNearJump = 1e-5;

// Against the reference: 8-bit steps of any channel, and dB over all images of a kind.
constexpr int kLargestError = 2;
constexpr double kLeastPsnr = 55;

struct ImageError {
  int largest = 0;     // of any channel, 8-bit steps
  double squared = 0;  // sum over the pixels and channels compared
  std::size_t channels = 0;
  std::size_t drawn = 0;    // pixels that are not the background
  std::size_t skipped = 0;  // pixels that rounding alone may change: a ray in a plane of faces, a sample at a jump
  std::string worst{};      // pixel and both colours

  double psnr() const;  // dB; infinite where nothing differs
  void add(const ImageError& other);
};

ImageError compareImages(const Frame& a, const Frame& b);

// Against the rounded reference. The colour of a pixel that neither side covers at all is nobody's. Pixels with a
// sample whose density is within `near_jump` (stored units) of where what is seen jumps are skipped, and where it is
// above 0 those of which a rounding chooses between two colours.
ImageError compareToReference(const Frame& frame, const reference::Image& expected,
                              const std::array<std::uint8_t, 4>& background, double near_jump = 0);

struct ProbeError {
  std::size_t pixels = 0;
  std::size_t met = 0;        // something is hit or crossed
  std::size_t wrong = 0;      // another voxel, or another count
  std::size_t unexcused = 0;  // wrong though the ray is nowhere within kNearEdge of an edge
  std::string worst{};        // first unexcused, else first wrong

  void add(const ProbeError& other);
};

ProbeError compareHits(const Frame& frame, const reference::Image& expected, double voxels_per_world);
ProbeError compareBlocks(const Frame& frame, const reference::Image& expected);

}  // namespace blockwalk::test
