// SPDX-License-Identifier: Apache-2.0
// Gauges: how far the kernels are from the float64 reference in one scenario, under every finder, walk and cull. Each
// expects a whole, finite frame, no loop bound hit, and something to be seen.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "tests/reference/dense_volume.h"
#include "view/view.h"
#include "volume/build/builder.h"
#include "volume/source.h"

namespace blockwalk::extreme {

struct Scenario {
  std::shared_ptr<Source> source;
  View view{};
  std::vector<Filter> filters{Filter::nearest, Filter::linear};
  BuildOptions build{};
  // A dense volume with the same field where the rays run, when the whole would not fit in memory.
  std::shared_ptr<reference::DenseVolume> reference = nullptr;
  bool blank = false;  // the image must be background alone
};

// Clumps over two blocks an axis, so that block faces are among the planes; densities on both sides of the range.
Scenario clumpScenario(const View& view);

// Largest difference of a channel to the unrounded reference, in 8-bit steps; colours weigh as much as they cover. A
// perfect image has up to 0.5.
double imageError(const Scenario& scenario);

// mode first-hit: voxels that are not the reference's (NaN counts), in all combinations; the images' error does not
// count.
double wrongHits(const Scenario& scenario);

// Relative error of an optical depth, far below an 8-bit step: the strength at which one pixel turns from `byte` to
// `byte` + 1 is found by bisection between `lo` and `hi` (geometrically), and there the reference's optical depth is
// compared with the one that gives (byte + 0.5) / 255. White matter over black measures the sum of what is gathered,
// black over white the transmittance.
struct DepthScenario {
  Scenario scenario;  // view: all but the strength
  std::function<void(View& view, double strength)> set_strength;
  double lo = 1e-15;
  double hi = 1e15;
  int byte = 127;
  bool dark = false;  // the matter is black
};
double depthError(const DepthScenario& scenario);

// 0 when resolving the view is an error that names `field`, else 1.
double isNotRefused(const Scenario& scenario, const std::string& field);

}  // namespace blockwalk::extreme
