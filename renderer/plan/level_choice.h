// SPDX-License-Identifier: Apache-2.0
// Which level of a volume a view is drawn from.
#pragma once

#include <vector>

#include "view/resolved_view.h"

namespace blockwalk {

// The level whose voxels are about as large as a pixel where the volume is nearest; never coarser than a pixel there.
int chooseLevel(const ResolvedView& view, const VolumeInfo& info);

// The one that the view names, or that is chosen, which is `finest` or a coarser one. Mode mip never draws means of
// intensities: where a level has no maxima, the finest is drawn instead.
int drawnLevel(const ResolvedView& view, const VolumeInfo& info, int finest);

// A coarser level, which is drawn from a depth before the eye on, along the view's direction, or from where a ray has
// less transmittance left.
struct FarLevel {
  int level = 0;
  Form form = Form::values;
  double depth = 0;          // world
  double transmittance = 0;  // of 0 none has less
};

// Those that the view draws beside `level`, the finest first: as many as a kernel takes, up to the first of which
// nothing is stored. Of a mode that never draws means those of maxima alone. None where one level serves all of the
// frame.
std::vector<FarLevel> farLevels(const ResolvedView& view, const VolumeInfo& info, int level);

}  // namespace blockwalk
