// SPDX-License-Identifier: Apache-2.0
// What cuts a view's volume.
#pragma once

#include <vector>

#include "view/resolved_view.h"

namespace blockwalk {

// The planes of the view's clip box and its own, of those that cut the volume's box: the others exclude nothing of it.
// Normals are unit vectors. Planes that leave nothing of the volume are kept.
std::vector<ClipPlane> cuttingPlanes(const ResolvedView& view, const VolumeInfo& info);

}  // namespace blockwalk
