// SPDX-License-Identifier: Apache-2.0
// From black to white, where nobody chose it.
#pragma once

#include "view/view.h"

namespace blockwalk {

// All but so many of the non-empty voxels lie between, as in Fiji's Auto.
constexpr double kBlackShare = 0.0035;
constexpr double kWhiteShare = 0.998;

// Data units, by the histogram: evenly inside each of its bins. All of the histogram where no values lie between.
DensityRange quantileWindow(const ChannelInfo& channel);

}  // namespace blockwalk
