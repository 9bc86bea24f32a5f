// SPDX-License-Identifier: Apache-2.0
// Whether the voxels of a level are paged, and what stands in for those that are absent (docs/large.md).
#pragma once

#include "renderer/plan/plan.h"

namespace blockwalk {

// What the plan's voxels take on the device, of all its channels and the level as a whole.
std::uint64_t voxelBytes(const VolumeInfo& info, const Plan& plan);

// Sets the plan's coarser level and its key where the voxels that it draws take more than so many bytes, of all its
// channels, on the device; 0: never. The level and form, channels and apron of the plan must stand. The coarser level
// is the finest that takes an eighth at most of the room that there is for pages.
void choosePaging(const ResolvedView& view, const VolumeInfo& info, const DeviceTraits& device, Plan& plan);

}  // namespace blockwalk
