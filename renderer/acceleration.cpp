// SPDX-License-Identifier: Apache-2.0
#include "renderer/acceleration.h"

namespace blockwalk {
namespace {

std::uint64_t addressOf(const Device& device, const AccelerationStructure& structure) {
  return device.handle().getAccelerationStructureAddressKHR({.accelerationStructure = *structure.handle});
}

AccelerationStructure build(Device& device, vk::AccelerationStructureTypeKHR type,
                            const vk::AccelerationStructureGeometryKHR& geometry, std::uint32_t count) {
  vk::AccelerationStructureBuildGeometryInfoKHR info{
      .type = type,
      .flags = vk::BuildAccelerationStructureFlagBitsKHR::ePreferFastTrace,
      .mode = vk::BuildAccelerationStructureModeKHR::eBuild,
      .geometryCount = 1,
      .pGeometries = &geometry};
  const auto sizes = device.handle().getAccelerationStructureBuildSizesKHR(
      vk::AccelerationStructureBuildTypeKHR::eDevice, info, count);
  AccelerationStructure structure;
  structure.storage = Buffer(device, sizes.accelerationStructureSize, BufferUse::structure);
  structure.handle = device.handle().createAccelerationStructureKHR(
      {.buffer = structure.storage.handle(), .size = sizes.accelerationStructureSize, .type = type});
  const std::uint64_t alignment = device.scratchAlignment();
  const Buffer scratch(device, sizes.buildScratchSize + alignment, BufferUse::scratch);
  info.dstAccelerationStructure = *structure.handle;
  info.scratchData.deviceAddress = (scratch.address() + alignment - 1) / alignment * alignment;
  const vk::AccelerationStructureBuildRangeInfoKHR range{.primitiveCount = count};
  device.submitAndWait(
      [&](const vk::raii::CommandBuffer& commands) { commands.buildAccelerationStructuresKHR(info, &range); });
  return structure;
}

}  // namespace

AccelerationStructure buildUnitBox(Device& device) {
  const Buffer box(device, sizeof(vk::AabbPositionsKHR), BufferUse::instances);
  box.mappedAs<VkAabbPositionsKHR>()[0] = {.minX = -kBoxSlack,
                                           .minY = -kBoxSlack,
                                           .minZ = -kBoxSlack,
                                           .maxX = 1 + kBoxSlack,
                                           .maxY = 1 + kBoxSlack,
                                           .maxZ = 1 + kBoxSlack};
  vk::AccelerationStructureGeometryKHR geometry{.geometryType = vk::GeometryTypeKHR::eAabbs};
  geometry.geometry.aabbs = vk::AccelerationStructureGeometryAabbsDataKHR{.stride = sizeof(vk::AabbPositionsKHR)};
  geometry.geometry.aabbs.data.deviceAddress = box.address();
  return build(device, vk::AccelerationStructureTypeKHR::eBottomLevel, geometry, 1);
}

AccelerationStructure buildBlockInstances(Device& device, const AccelerationStructure& unit_box, const Level& level,
                                          int block_voxels) {
  BLOCKWALK_CHECK(level.blocks.size(), <=, device.maxInstances());
  const Buffer instances(device, level.blocks.size() * sizeof(VkAccelerationStructureInstanceKHR),
                         BufferUse::instances);
  const auto records = instances.mappedAs<VkAccelerationStructureInstanceKHR>();
  const std::uint64_t box = addressOf(device, unit_box);
  const auto side = static_cast<float>(block_voxels);
  for (std::size_t i = 0; i < level.blocks.size(); ++i) {
    const glm::vec3 corner = level.blocks[i].origin * block_voxels;
    records[i] = {.transform = {{{side, 0, 0, corner.x}, {0, side, 0, corner.y}, {0, 0, side, corner.z}}},
                  .instanceCustomIndex = 0,
                  .mask = level.blocks[i].range_mask,
                  .instanceShaderBindingTableRecordOffset = 0,
                  .flags = 0,
                  .accelerationStructureReference = box};
  }
  vk::AccelerationStructureGeometryKHR geometry{.geometryType = vk::GeometryTypeKHR::eInstances};
  geometry.geometry.instances = vk::AccelerationStructureGeometryInstancesDataKHR{};
  geometry.geometry.instances.data.deviceAddress = instances.address();
  return build(device, vk::AccelerationStructureTypeKHR::eTopLevel, geometry,
               static_cast<std::uint32_t>(level.blocks.size()));
}

}  // namespace blockwalk
