// SPDX-License-Identifier: Apache-2.0
#include "renderer/kernels.h"

#include <array>

#include "render.spv.h"
#include "render_rayquery.spv.h"
#include "shaders/kernel_interface.h"

namespace blockwalk {

Kernels::Kernels(const Device& device) : device_(device) {
  const auto& handle = device.handle();
  const vk::PushConstantRange push{
      .stageFlags = vk::ShaderStageFlagBits::eCompute, .offset = 0, .size = sizeof(gpu::PushConstants)};
  plain_layout_ = handle.createPipelineLayout(vk::PipelineLayoutCreateInfo{}.setPushConstantRanges(push));
  plain_module_ = makeModule(false);
  cache_ = handle.createPipelineCache({});
  if (!device.rayQuery()) return;

  const vk::DescriptorSetLayoutBinding binding{.binding = 0,
                                               .descriptorType = vk::DescriptorType::eAccelerationStructureKHR,
                                               .descriptorCount = 1,
                                               .stageFlags = vk::ShaderStageFlagBits::eCompute};
  set_layout_ = handle.createDescriptorSetLayout(vk::DescriptorSetLayoutCreateInfo{}.setBindings(binding));
  query_layout_ = handle.createPipelineLayout(
      vk::PipelineLayoutCreateInfo{}.setSetLayouts(*set_layout_).setPushConstantRanges(push));
  const vk::DescriptorPoolSize size{.type = vk::DescriptorType::eAccelerationStructureKHR, .descriptorCount = 1};
  descriptor_pool_ = handle.createDescriptorPool(
      vk::DescriptorPoolCreateInfo{.flags = vk::DescriptorPoolCreateFlagBits::eFreeDescriptorSet, .maxSets = 1}
          .setPoolSizes(size));
  set_ = std::move(handle.allocateDescriptorSets(
      vk::DescriptorSetAllocateInfo{.descriptorPool = *descriptor_pool_}.setSetLayouts(*set_layout_))[0]);
  query_module_ = makeModule(true);
}

vk::raii::ShaderModule Kernels::makeModule(bool ray_query) const {
  const auto words =
      ray_query ? std::span<const std::uint32_t>(render_rayquery_spirv) : std::span<const std::uint32_t>(render_spirv);
  return device_.handle().createShaderModule({.codeSize = words.size_bytes(), .pCode = words.data()});
}

vk::DescriptorSet Kernels::bindInstances(vk::AccelerationStructureKHR instances) {
  const vk::WriteDescriptorSetAccelerationStructureKHR structure{.accelerationStructureCount = 1,
                                                                 .pAccelerationStructures = &instances};
  const vk::WriteDescriptorSet write{.pNext = &structure,
                                     .dstSet = *set_,
                                     .dstBinding = 0,
                                     .descriptorCount = 1,
                                     .descriptorType = vk::DescriptorType::eAccelerationStructureKHR};
  device_.handle().updateDescriptorSets(write, {});
  return *set_;
}

const vk::raii::Pipeline& Kernels::pipeline(const KernelKey& key) {
  const auto found = pipelines_.find(key);
  if (found != pipelines_.end()) return found->second;

  const bool ray_query = key.finder == gpu::kFinderQuery;
  std::array<vk::SpecializationMapEntry, kKernelConstants> entries;
  for (std::uint32_t i = 0; i < kKernelConstants; ++i) {
    entries[i] = vk::SpecializationMapEntry{.constantID = i, .offset = i * 4, .size = 4};
  }
  const vk::SpecializationInfo specialisation{
      .mapEntryCount = kKernelConstants, .pMapEntries = entries.data(), .dataSize = sizeof key, .pData = &key};
  const vk::ComputePipelineCreateInfo create{.stage = {.stage = vk::ShaderStageFlagBits::eCompute,
                                                       .module = ray_query ? *query_module_ : *plain_module_,
                                                       .pName = "main",
                                                       .pSpecializationInfo = &specialisation},
                                             .layout = *layout(ray_query)};
  return pipelines_.emplace(key, device_.handle().createComputePipeline(cache_, create)).first->second;
}

}  // namespace blockwalk
