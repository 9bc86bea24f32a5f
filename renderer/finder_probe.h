// SPDX-License-Identifier: Apache-2.0
// What the finder `auto` means for a volume on a device is measured, once.
#pragma once

#include <functional>
#include <span>

#include "view/resolved_view.h"

namespace blockwalk {

// Of a probe's picture: a few thousand rays.
constexpr int kProbeSide = 64;
constexpr int kProbeRounds = 3;

// The candidate whose least time in `rounds` rounds is the least; of equals the first. The candidates take turns, and
// each is measured once before that to no account: that compiles and makes resident. `candidates` is not empty.
Finder fastestFinder(std::span<const Finder> candidates, int rounds, const std::function<double(Finder)>& measure);

}  // namespace blockwalk
