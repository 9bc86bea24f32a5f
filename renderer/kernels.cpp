// SPDX-License-Identifier: Apache-2.0
#include "renderer/kernels.h"

#include <array>

#include "render.spv.h"
#include "render_general.spv.h"
#include "render_general_rayquery.spv.h"
#include "render_rayquery.spv.h"

namespace blockwalk {

static_assert(kKernelConstants == gpu::kChoiceCount);

Kernels::Kernels(const Device& device) : device_(device) {
  const auto& handle = device.handle();
  const vk::PushConstantRange push{
      .stageFlags = vk::ShaderStageFlagBits::eCompute, .offset = 0, .size = kChoicesOffset + sizeof(KernelKey)};
  plain_layout_ = handle.createPipelineLayout(vk::PipelineLayoutCreateInfo{}.setPushConstantRanges(push));
  plain_module_ = makeModule(render_spirv);
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
  query_module_ = makeModule(render_rayquery_spirv);
}

vk::raii::ShaderModule Kernels::makeModule(std::span<const std::uint32_t> words) const {
  return device_.handle().createShaderModule({.codeSize = words.size_bytes(), .pCode = words.data()});
}

vk::raii::Pipeline Kernels::makePipeline(bool ray_query, const vk::PipelineShaderStageCreateInfo& stage) const {
  return device_.handle().createComputePipeline(
      cache_, vk::ComputePipelineCreateInfo{.stage = stage, .layout = *layout(ray_query)});
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

  const bool ray_query =
      key.finder == gpu::kFinderQuery || key.finder == gpu::kFinderClusters || key.finder == gpu::kFinderBoundary;
  std::array<vk::SpecializationMapEntry, kKernelConstants> entries;
  for (std::uint32_t i = 0; i < kKernelConstants; ++i) {
    entries[i] = vk::SpecializationMapEntry{.constantID = i, .offset = i * 4, .size = 4};
  }
  const vk::SpecializationInfo specialisation{
      .mapEntryCount = kKernelConstants, .pMapEntries = entries.data(), .dataSize = sizeof key, .pData = &key};
  return pipelines_
      .emplace(key, makePipeline(ray_query, {.stage = vk::ShaderStageFlagBits::eCompute,
                                             .module = ray_query ? *query_module_ : *plain_module_,
                                             .pName = "main",
                                             .pSpecializationInfo = &specialisation}))
      .first->second;
}

const vk::raii::Pipeline& Kernels::general(bool ray_query) {
  const auto found = general_.find(ray_query);
  if (found != general_.end()) return found->second;
  const vk::raii::ShaderModule module =
      ray_query ? makeModule(render_general_rayquery_spirv) : makeModule(render_general_spirv);
  return general_
      .emplace(
          ray_query,
          makePipeline(ray_query, {.stage = vk::ShaderStageFlagBits::eCompute, .module = *module, .pName = "main"}))
      .first->second;
}

}  // namespace blockwalk
