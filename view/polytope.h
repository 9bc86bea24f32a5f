// SPDX-License-Identifier: Apache-2.0
// What half-spaces leave of a volume's box.
#pragma once

#include <span>
#include <vector>

#include "view/resolved_view.h"

namespace blockwalk {

// Whether the cuts, half-spaces of world, leave something of the volume's box that is not flat, and something of that
// lies in the picture's half-spaces, if there are some: these may be as narrow as they like.
bool leavesSome(const VolumeInfo& info, std::span<const ClipPlane> cuts, std::span<const ClipPlane> picture = {});

// The half-spaces of a view's clip box and planes.
std::vector<ClipPlane> clipPlanes(const ResolvedView& view);

// Those whose common part is what the picture looks at: before the eye, and between the picture's edges.
std::vector<ClipPlane> picturePlanes(const Camera& camera);

}  // namespace blockwalk
