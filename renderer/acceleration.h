// SPDX-License-Identifier: Apache-2.0
// Acceleration structures of the query finder: one instance a block over one shared unit box (Derin et al. 2021, 2.1).
#pragma once

#include "renderer/buffer.h"

namespace blockwalk {

// A built structure and its storage.
struct AccelerationStructure {
  Buffer storage;
  vk::raii::AccelerationStructureKHR handle{nullptr};
};

// A bottom-level structure with one box from -kBoxSlack to 1 + kBoxSlack. The slack covers the driver's rounding; the
// kernel decides by the exact planes.
constexpr float kBoxSlack = 1.0f / 1024;
AccelerationStructure buildUnitBox(Device& device);

// A top-level structure: block i is instance i, masked by its range mask, in the level's index space.
// At most Device::maxInstances() blocks.
AccelerationStructure buildBlockInstances(Device& device, const AccelerationStructure& unit_box, const Level& level,
                                          int block_voxels);

}  // namespace blockwalk
