// SPDX-License-Identifier: Apache-2.0
// Views that between them meet every kind of camera and range: outside, inside, along axes, orthographic, far away,
// clipped, of odd sizes, with ranges that are random, empty or one value wide.
#pragma once

#include <vector>

#include "tests/reference/dense_volume.h"
#include "view/view.h"

namespace blockwalk::test {

constexpr int kViewCount = 20;

// All resolved, level 0, mode blend. The same seed gives the same views. `dense` is level 0 of the volume.
std::vector<View> randomViews(const VolumeInfo& info, const reference::DenseVolume& dense, std::uint32_t seed);

}  // namespace blockwalk::test
