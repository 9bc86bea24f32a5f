// SPDX-License-Identifier: Apache-2.0
// Readable pictures of a frame's numbers (docs/integration.md, "Outputs"): what png, jpeg and webp show of depth,
// value, position, cost and queries.
#pragma once

#include <cstdint>
#include <vector>

#include "view/frame.h"

namespace blockwalk {

// Whether an output's picture is that below: of depth and value.
bool isGrey(Output output);
// 0 where there is nothing, else 1 at the volume's near depth, or the lower end of the range, to 65535 at the far or
// upper one, linear, and as much beyond.
std::vector<std::uint16_t> greyPicture(const Frame& frame);

// Straight rgba8, red in the lowest byte. Depth and value: the upper byte of greyPicture(), grey. Position: red, green
// and blue run along x, y and z from one end of the volume's world box to the other; no opacity where there is nothing.
// Cost: black, violet, red, orange and pale yellow at 0, 31, 255, 2047 and 16383, linear in log2(1 + cost) between;
// queries: the same at 0, 3, 15, 63 and 255.
std::vector<std::uint32_t> outputPicture(const Frame& frame);

}  // namespace blockwalk
