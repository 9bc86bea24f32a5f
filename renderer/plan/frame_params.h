// SPDX-License-Identifier: Apache-2.0
// The numbers of one frame for the kernel: rays, box, clip planes, ranges. Computed in double, stored in float.
#pragma once

#include "renderer/plan/plan.h"
#include "shaders/kernel_interface.h"

namespace blockwalk {

// Everything but the device addresses, the grid's dims and the tables.
gpu::FrameData makeFrameData(const ResolvedView& view, const VolumeInfo& info, const Plan& plan);

// How far before the eye t is 0: at the volume when the eye is outside its bounding sphere, so that rays differ in
// small numbers there; at the eye when it is near or inside.
double anchorDepth(const Camera& camera, const WorldBox& box);

}  // namespace blockwalk
