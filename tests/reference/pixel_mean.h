// SPDX-License-Identifier: Apache-2.0
// The truth of a picture of several samples a pixel: the mean over the pixel's area, of rays that are converged
// themselves (tests/reference/converged.h).
//
// A pixel's rays are Hammersley's points (1960), which have nothing to do with the places that samples are taken at: 16
// of them, 64, at most 256, until no channel changes by more than kMeanTolerance and none is expected to be wrong by
// more were all its variation one edge. Of N points the share on one side of a random straight edge is wrong by 0.3
// N^(-3/4), root mean square: at 256 a 210th of the contrast, an eighth of what 16 samples leave. Two agreeing means
// alone say little: on an edge they agree by chance.
#pragma once

#include "tests/reference/reference.h"

namespace blockwalk::reference {

constexpr double kMeanTolerance = 0.1 / 255;

// Mode blend, filter linear; step, classification and samples are not looked at. A pixel has a colour and nothing else.
Pixel renderPixelMean(const DenseVolume& volume, const View& resolved, int x, int y);

Image renderImageMean(const DenseVolume& volume, const View& resolved);

}  // namespace blockwalk::reference
