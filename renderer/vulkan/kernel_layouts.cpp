// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan/kernel_layouts.h"

#include <span>

#include "render.spv.h"
#include "render_general.spv.h"
#include "render_general_rayquery.spv.h"
#include "render_rayquery.spv.h"
#include "renderer/vulkan/specialise.h"

namespace blockwalk {

KernelName generalKernel(KernelKey key) {
#define BLOCKWALK_KEEP(id, type, member, constant, initial)
#define BLOCKWALK_CLEAR(id, type, member, constant, initial) key.member = 0;
  BLOCKWALK_CHOICES(BLOCKWALK_KEEP, BLOCKWALK_CLEAR)
#undef BLOCKWALK_KEEP
#undef BLOCKWALK_CLEAR
  return {.key = key, .general = true};
}

std::vector<std::uint32_t> kernelWords(const KernelName& name) {
  using Words = std::span<const std::uint32_t>;
  const bool ray_query = name.key.queriesRays();
  const Words module = name.general ? (ray_query ? Words(render_general_rayquery_spirv) : Words(render_general_spirv))
                                    : (ray_query ? Words(render_rayquery_spirv) : Words(render_spirv));
  return specialise(module, name.key);
}

KernelLayouts::KernelLayouts(const vk::raii::Device& device, bool ray_query) : device_(device) {
  const vk::PushConstantRange push{
      .stageFlags = vk::ShaderStageFlagBits::eCompute, .offset = 0, .size = kChoicesOffset + sizeof(KernelKey)};
  plain_ = device.createPipelineLayout(vk::PipelineLayoutCreateInfo{}.setPushConstantRanges(push));
  if (!ray_query) return;
  const vk::DescriptorSetLayoutBinding binding{.binding = 0,
                                               .descriptorType = vk::DescriptorType::eAccelerationStructureKHR,
                                               .descriptorCount = kMostInstances,
                                               .stageFlags = vk::ShaderStageFlagBits::eCompute};
  set_ = device.createDescriptorSetLayout(vk::DescriptorSetLayoutCreateInfo{}.setBindings(binding));
  query_ = device.createPipelineLayout(vk::PipelineLayoutCreateInfo{}.setSetLayouts(*set_).setPushConstantRanges(push));
}

vk::raii::Pipeline KernelLayouts::make(const KernelName& name, const std::vector<std::uint32_t>& words) const {
  const vk::raii::ShaderModule module =
      device_.createShaderModule({.codeSize = words.size() * sizeof(std::uint32_t), .pCode = words.data()});
  const vk::PipelineShaderStageCreateInfo stage{
      .stage = vk::ShaderStageFlagBits::eCompute, .module = *module, .pName = "main"};
  return device_.createComputePipeline(nullptr,
                                       vk::ComputePipelineCreateInfo{.flags = vk::PipelineCreateFlagBits::eDispatchBase,
                                                                     .stage = stage,
                                                                     .layout = *layout(name.key.queriesRays())});
}

}  // namespace blockwalk
