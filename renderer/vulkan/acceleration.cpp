// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan/acceleration.h"

#include <fmt/format.h>

#include "view/view.h"

namespace blockwalk {
namespace {

AccelerationStructure allocate(Device& device, vk::AccelerationStructureTypeKHR type, std::uint64_t bytes) {
  AccelerationStructure structure;
  structure.storage = Buffer(device, bytes, BufferUse::structure);
  structure.handle = device.calls().guard(DeviceCall::create, "an acceleration structure", [&] {
    return device.handle().createAccelerationStructureKHR(
        {.buffer = structure.storage.handle(), .size = bytes, .type = type});
  });
  return structure;
}

AccelerationStructure build(Device& device, vk::AccelerationStructureTypeKHR type,
                            const vk::AccelerationStructureGeometryKHR& geometry, std::uint32_t count,
                            vk::BuildAccelerationStructureFlagsKHR flags = {}) {
  vk::AccelerationStructureBuildGeometryInfoKHR info{
      .type = type,
      .flags = vk::BuildAccelerationStructureFlagBitsKHR::ePreferFastTrace | flags,
      .mode = vk::BuildAccelerationStructureModeKHR::eBuild,
      .geometryCount = 1,
      .pGeometries = &geometry};
  const auto sizes = device.handle().getAccelerationStructureBuildSizesKHR(
      vk::AccelerationStructureBuildTypeKHR::eDevice, info, count);
  AccelerationStructure structure = allocate(device, type, sizes.accelerationStructureSize);
  const std::uint64_t alignment = device.scratchAlignment();
  const Buffer scratch(device, sizes.buildScratchSize + alignment, BufferUse::scratch);
  info.dstAccelerationStructure = *structure.handle;
  info.scratchData.deviceAddress = (scratch.address() + alignment - 1) / alignment * alignment;
  const vk::AccelerationStructureBuildRangeInfoKHR range{.primitiveCount = count};
  device.submitAndWait(
      [&](const vk::raii::CommandBuffer& commands) { commands.buildAccelerationStructuresKHR(info, &range); });
  return structure;
}

// Into as much memory as it turned out to need.
AccelerationStructure compacted(Device& device, const AccelerationStructure& large) {
  const vk::raii::QueryPool sizes = device.calls().guard(DeviceCall::create, "a query pool", [&] {
    return device.handle().createQueryPool(
        {.queryType = vk::QueryType::eAccelerationStructureCompactedSizeKHR, .queryCount = 1});
  });
  sizes.reset(0, 1);
  device.submitAndWait([&](const vk::raii::CommandBuffer& commands) {
    commands.writeAccelerationStructuresPropertiesKHR(*large.handle,
                                                      vk::QueryType::eAccelerationStructureCompactedSizeKHR, *sizes, 0);
  });
  const auto [result, bytes] =
      sizes.getResult<std::uint64_t>(0, 1, sizeof(std::uint64_t), vk::QueryResultFlagBits::e64);
  AccelerationStructure small = allocate(device, vk::AccelerationStructureTypeKHR::eBottomLevel, bytes);
  device.submitAndWait([&](const vk::raii::CommandBuffer& commands) {
    commands.copyAccelerationStructureKHR(
        {.src = *large.handle, .dst = *small.handle, .mode = vk::CopyAccelerationStructureModeKHR::eCompact});
  });
  return small;
}

AccelerationStructure buildCompacted(Device& device, const vk::AccelerationStructureGeometryKHR& geometry,
                                     std::uint32_t count) {
  if (count > device.maxPrimitives()) {
    throw ViewError("finder", fmt::format("what shows something has {} boxes or triangles, the device takes {}; use "
                                          "larger macrocells, a coarser level, or another finder",
                                          count, device.maxPrimitives()));
  }
  return compacted(device, build(device, vk::AccelerationStructureTypeKHR::eBottomLevel, geometry, count,
                                 vk::BuildAccelerationStructureFlagBitsKHR::eAllowCompaction));
}

vk::AccelerationStructureGeometryKHR boxGeometry(const Buffer& boxes) {
  vk::AccelerationStructureGeometryKHR geometry{.geometryType = vk::GeometryTypeKHR::eAabbs};
  geometry.geometry.aabbs = vk::AccelerationStructureGeometryAabbsDataKHR{.stride = sizeof(vk::AabbPositionsKHR)};
  geometry.geometry.aabbs.data.deviceAddress = boxes.address();
  return geometry;
}

}  // namespace

std::uint64_t addressOf(const Device& device, const AccelerationStructure& structure) {
  return device.handle().getAccelerationStructureAddressKHR({.accelerationStructure = *structure.handle});
}

AccelerationStructure buildInstances(Device& device, const Buffer& instances, std::uint32_t count) {
  vk::AccelerationStructureGeometryKHR geometry{.geometryType = vk::GeometryTypeKHR::eInstances};
  geometry.geometry.instances = vk::AccelerationStructureGeometryInstancesDataKHR{};
  geometry.geometry.instances.data.deviceAddress = instances.address();
  return build(device, vk::AccelerationStructureTypeKHR::eTopLevel, geometry, count);
}

AccelerationStructure buildUnitBox(Device& device) {
  const Buffer box(device, sizeof(vk::AabbPositionsKHR), BufferUse::instances);
  box.mappedAs<VkAabbPositionsKHR>()[0] = {.minX = -kBoxSlack,
                                           .minY = -kBoxSlack,
                                           .minZ = -kBoxSlack,
                                           .maxX = 1 + kBoxSlack,
                                           .maxY = 1 + kBoxSlack,
                                           .maxZ = 1 + kBoxSlack};
  return build(device, vk::AccelerationStructureTypeKHR::eBottomLevel, boxGeometry(box), 1);
}

AccelerationStructure buildBoxes(Device& device, const Buffer& boxes, std::uint32_t count) {
  return buildCompacted(device, boxGeometry(boxes), count);
}

AccelerationStructure buildTriangles(Device& device, const Buffer& vertices, std::uint32_t count) {
  vk::AccelerationStructureGeometryKHR geometry{.geometryType = vk::GeometryTypeKHR::eTriangles,
                                                .flags = vk::GeometryFlagBitsKHR::eOpaque};
  geometry.geometry.triangles =
      vk::AccelerationStructureGeometryTrianglesDataKHR{.vertexFormat = vk::Format::eR32G32B32Sfloat,
                                                        .vertexStride = 3 * sizeof(float),
                                                        .maxVertex = 3 * count - 1,
                                                        .indexType = vk::IndexType::eNoneKHR};
  geometry.geometry.triangles.vertexData.deviceAddress = vertices.address();
  return buildCompacted(device, geometry, count);
}

AccelerationStructure buildOneInstance(Device& device, const AccelerationStructure& bottom, std::uint8_t mask) {
  const Buffer instances(device, sizeof(VkAccelerationStructureInstanceKHR), BufferUse::instances);
  instances.mappedAs<VkAccelerationStructureInstanceKHR>()[0] = {
      .transform = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}},
      .instanceCustomIndex = 0,
      .mask = mask,
      .instanceShaderBindingTableRecordOffset = 0,
      .flags = 0,
      .accelerationStructureReference = addressOf(device, bottom)};
  return buildInstances(device, instances, 1);
}

}  // namespace blockwalk
