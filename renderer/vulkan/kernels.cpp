// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan/kernels.h"

#include "render.spv.h"
#include "render_general.spv.h"
#include "render_general_rayquery.spv.h"
#include "render_rayquery.spv.h"
#include "renderer/vulkan/specialise.h"

namespace blockwalk {

Kernels::Kernels(const Device& device) : device_(device) {
  const auto& handle = device.handle();
  const vk::PushConstantRange push{
      .stageFlags = vk::ShaderStageFlagBits::eCompute, .offset = 0, .size = kChoicesOffset + sizeof(KernelKey)};
  plain_layout_ = handle.createPipelineLayout(vk::PipelineLayoutCreateInfo{}.setPushConstantRanges(push));
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
}

vk::raii::ShaderModule Kernels::makeModule(std::span<const std::uint32_t> words) const {
  return device_.handle().createShaderModule({.codeSize = words.size_bytes(), .pCode = words.data()});
}

vk::raii::Pipeline Kernels::makePipeline(bool ray_query, vk::ShaderModule module) const {
  const vk::PipelineShaderStageCreateInfo stage{
      .stage = vk::ShaderStageFlagBits::eCompute, .module = module, .pName = "main"};
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

  const bool ray_query = key.queriesRays();
  const std::vector<std::uint32_t> words =
      specialise(ray_query ? std::span<const std::uint32_t>(render_rayquery_spirv) : render_spirv, key);
  const vk::raii::ShaderModule module = makeModule(words);
  return pipelines_.emplace(key, makePipeline(ray_query, *module)).first->second;
}

const vk::raii::Pipeline& Kernels::general(bool ray_query) {
  const auto found = general_.find(ray_query);
  if (found != general_.end()) return found->second;
  const vk::raii::ShaderModule module =
      ray_query ? makeModule(render_general_rayquery_spirv) : makeModule(render_general_spirv);
  return general_.emplace(ray_query, makePipeline(ray_query, *module)).first->second;
}

}  // namespace blockwalk
