// SPDX-License-Identifier: Apache-2.0
// Where the error of the default picture comes from, each source by itself, and how fast the step's part falls.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "bench/experiments/image_error.h"
#include "renderer/renderer.h"
#include "tests/reference/dense_volume.h"

namespace blockwalk::bench {

// `base` is the default picture's view, resolved: linear, blend, post-classified; `truth` its integral without a step.
// [{"source", "how", "rmse", "max"}], 8-bit steps. "how" says which two pictures are compared: the step's and the
// filter's share, and that of rounding to bytes, are of the float64 reference alone; what arithmetic, traversal, early
// ends and codecs change is measured on the device's pictures, so that it includes what rounding makes of it.
nlohmann::json errorBudget(Renderer& renderer, ResidentVolume& volume, const reference::DenseVolume& dense,
                           const View& base, const ColorImage& truth);

// The lattice rule in float64, so that no rounding to bytes hides it, against its limit for small steps: of the picture
// itself, and of the exceptions where the integrand jumps: a range that cuts through the visible densities, and a
// stepped transfer function. [{"look", "steps": [{"step", "rmse"}], "orders": [{"from", "to", "order"}]}], where order
// is log2 of the error's fall.
nlohmann::json convergenceOrders(const reference::DenseVolume& dense, const View& base, const ColorImage& truth);

}  // namespace blockwalk::bench
