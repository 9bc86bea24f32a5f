// SPDX-License-Identifier: Apache-2.0
// Brings to the device what the kernel reads beside voxels: records of blocks and subblocks, the empty subblock, and
// transfer functions.
#pragma once

#include "renderer/resident/parts.h"

namespace blockwalk {

std::unique_ptr<Making> makeBlocks(Device& device, const StoredVolume& volume,
                                   std::shared_ptr<const ResidentVoxels> voxels);
std::unique_ptr<Making> makeMasks(Device& device, const StoredVolume& volume, const Need& need,
                                  std::shared_ptr<const ResidentVoxels> voxels);
// Of the blocks of a paged level in a coarser one.
std::unique_ptr<Making> makeAncestors(Device& device, const Need& need, std::shared_ptr<const ResidentVoxels> voxels,
                                      std::shared_ptr<const ResidentVoxels> coarse);
std::unique_ptr<Making> makeEmpty(Device& device, const StoredVolume& volume, const Need& need);
std::unique_ptr<Making> makeTable(Device& device, const StoredVolume& volume, const Need& need);

// The ranges of a level's subblocks: those that are still there, or read anew. Any thread; throws what VolumeFile does.
using Ranges = std::shared_ptr<const std::vector<Subblock>>;
Ranges rangesOf(const VolumeFile& file, const Need& need, Ranges kept);

}  // namespace blockwalk
