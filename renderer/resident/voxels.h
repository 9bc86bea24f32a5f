// SPDX-License-Identifier: Apache-2.0
// Brings the voxels of a channel of a level to the device.
#pragma once

#include "renderer/resident/pins.h"
#include "renderer/vulkan/device.h"

namespace blockwalk {

// Part::voxels: those that the file stores or, with an apron, the subblocks of volume/file/apron.h in the kernel's
// layout. `chunk_bytes` is the size of one allocation.
std::unique_ptr<Making> makeVoxels(Device& device, const StoredVolume& volume, const Need& need,
                                   std::uint64_t chunk_bytes);

}  // namespace blockwalk
