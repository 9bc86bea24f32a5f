// SPDX-License-Identifier: Apache-2.0
// Which level of a volume a view is drawn from.
#pragma once

#include "view/resolved_view.h"

namespace blockwalk {

// The level whose voxels are about as large as a pixel where the volume is nearest; never coarser than a pixel there.
int chooseLevel(const ResolvedView& view, const VolumeInfo& info);

// The one that the view names, or that is chosen, which is `finest` or a coarser one. Mode mip never draws means of
// intensities: where a level has no maxima, the finest is drawn instead.
int drawnLevel(const ResolvedView& view, const VolumeInfo& info, int finest);

}  // namespace blockwalk
