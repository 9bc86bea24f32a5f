// SPDX-License-Identifier: Apache-2.0
// Which blocks of a level a view can come to, where the records of all of them are too many to be there.
#pragma once

#include "renderer/plan/plan.h"

namespace blockwalk {

// Whether the level's records are read by windows.
bool isWindowed(const VolumeInfo& info, int level, Form form, const DeviceTraits& device);

// A box of blocks with all that rays of the view come to between two depths before the eye, and what the linear filter
// reads around them. It moves by some blocks at a time, so that views that move a little have the same. Not empty.
BlockWindow levelWindow(const ResolvedView& view, const VolumeInfo& info, int level, double near, double far);

// Of a plan whose voxels are paged: the windows of its levels.
void chooseWindows(const ResolvedView& view, const VolumeInfo& info, const DeviceTraits& device, Plan& plan);

// Blocks of the lattice in it; in the greatest of the plan's, 0 where it has none.
std::uint64_t cellsIn(const BlockWindow& window);
std::uint64_t windowCells(const Plan& plan);

}  // namespace blockwalk
