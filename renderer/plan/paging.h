// SPDX-License-Identifier: Apache-2.0
// Whether the voxels of a level are paged, and what stands in for those that are absent (docs/large.md).
#pragma once

#include "renderer/plan/plan.h"

namespace blockwalk {

// What the plan's voxels take on the device, of all its channels and levels as a whole, but for what stands in.
std::uint64_t voxelBytes(const VolumeInfo& info, const Plan& plan);

// Sets what of the plan is paged, what stands in for it, and its key, where the voxels that it draws take more than so
// many bytes, of all its channels, on the device; 0: never. The levels and forms, channels and apron of the plan must
// stand. What stands in is the finest level that takes a quarter at most of the room that there is for pages; it and
// coarser ones are resident as a whole.
void choosePaging(const ResolvedView& view, const VolumeInfo& info, const DeviceTraits& device, Plan& plan);

}  // namespace blockwalk
