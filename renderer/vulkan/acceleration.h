// SPDX-License-Identifier: Apache-2.0
// Acceleration structures: boxes and triangles, and instances of them.
#pragma once

#include "renderer/vulkan/buffer.h"

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

// A top-level structure of VkAccelerationStructureInstanceKHR[], each of a bottom-level structure by its address.
AccelerationStructure buildInstances(Device& device, const Buffer& instances, std::uint32_t count);
std::uint64_t addressOf(const Device& device, const AccelerationStructure& structure);

// Bottom-level structures, compacted (Wald et al. 2021, 4.2.3). Boxes are VkAabbPositionsKHR; triangles three vertices
// of three floats each, opaque. `count` is at least 1. Throws ViewError above
// Device::maxPrimitives().
AccelerationStructure buildBoxes(Device& device, const Buffer& boxes, std::uint32_t count);
AccelerationStructure buildTriangles(Device& device, const Buffer& vertices, std::uint32_t count);

// A top-level structure of one instance where it stands. A triangle's front is where cross(b - a, c - a) points to. No
// ray meets it where the mask is 0.
AccelerationStructure buildOneInstance(Device& device, const AccelerationStructure& bottom, std::uint8_t mask = 0xff);

}  // namespace blockwalk
