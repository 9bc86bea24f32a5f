// SPDX-License-Identifier: Apache-2.0
// Readable pictures of a frame's numbers (docs/integration.md, "Outputs"): what png, jpeg and webp show of depth,
// position, cost and queries.
#pragma once

#include <cstdint>
#include <vector>

#include "view/frame.h"

namespace blockwalk {

// Output depth: 0 where there is nothing, else 1 at the volume's near depth to 65535 at its far one, linear.
std::vector<std::uint16_t> depthPicture(const Frame& frame);

// Straight rgba8, red in the lowest byte. Depth: the upper byte of depthPicture(), grey. Position: red, green and blue
// run along x, y and z from one end of the volume's world box to the other; no opacity where there is nothing. Cost:
// black, violet, red, orange and pale yellow at 0, 31, 255, 2047 and 16383, linear in log2(1 + cost) between; queries:
// the same at 0, 3, 15, 63 and 255.
std::vector<std::uint32_t> outputPicture(const Frame& frame);

}  // namespace blockwalk
