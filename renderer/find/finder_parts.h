// SPDX-License-Identifier: Apache-2.0
// Makes resident what the finders grid, octree and query look in (docs/finders.md). `voxels` are those of any channel
// of the level, whose structure is the same in all; of several channels the range masks let everything pass, because
// none speaks for the others.
#pragma once

#include "renderer/resident/parts.h"

namespace blockwalk {

std::unique_ptr<Making> makeGrid(Device& device, const StoredVolume& volume,
                                 std::shared_ptr<const ResidentVoxels> voxels);
std::unique_ptr<Making> makeOctree(Device& device, const StoredVolume& volume, const Need& need,
                                   std::shared_ptr<const ResidentVoxels> voxels);
// `unit_box` outlives what is made.
std::unique_ptr<Making> makeInstances(Device& device, const StoredVolume& volume, const AccelerationStructure& unit_box,
                                      std::shared_ptr<const ResidentVoxels> voxels);

}  // namespace blockwalk
