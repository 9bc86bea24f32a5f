// SPDX-License-Identifier: Apache-2.0
// Acceleration structures: of the query finder, one instance a block over one shared unit box (Derin et al. 2021, 2.1);
// of the finders clusters and boundary, boxes and triangles under a single instance.
#pragma once

#include "renderer/vulkan/buffer.h"
#include "volume/volume.h"

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

// Bottom-level structures, compacted (Wald et al. 2021, 4.2.3). Boxes are VkAabbPositionsKHR; triangles three vertices
// of three floats each, opaque. `count` is at least 1. Throws ViewError above
// Device::maxPrimitives().
AccelerationStructure buildBoxes(Device& device, const Buffer& boxes, std::uint32_t count);
AccelerationStructure buildTriangles(Device& device, const Buffer& vertices, std::uint32_t count);

// A top-level structure of one instance where it stands. A triangle's front is where cross(b - a, c - a) points to. No
// ray meets it where the mask is 0.
AccelerationStructure buildOneInstance(Device& device, const AccelerationStructure& bottom, std::uint8_t mask = 0xff);

}  // namespace blockwalk
