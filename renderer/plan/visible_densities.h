// SPDX-License-Identifier: Apache-2.0
// Which densities of a channel a view can show: what macrocells are classified by (docs/finders.md).
#pragma once

#include <vector>

#include "renderer/plan/plan.h"

namespace blockwalk {

// Ascending intervals, both ends included, in densities as they are on the device (renderer/plan/density_scale.h).
// Outside of them nothing is visible; inside something may be. Where the mode looks at opacity, a transfer function's
// transparent stretches are left out, but for their first and last two table entries, between which the kernel
// interpolates. `table_scale` is TransferTable::scale, read only where there is a table.
std::vector<StoredRange> visibleDensities(const ResolvedView& view, const VolumeInfo& info, const ChannelPlan& drawn,
                                          float table_scale);

}  // namespace blockwalk
