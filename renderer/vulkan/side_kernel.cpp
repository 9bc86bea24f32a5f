// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan/side_kernel.h"

#include <vector>

namespace blockwalk {

vk::raii::PipelineLayout makePushLayout(const Device& device, std::uint32_t push_bytes) {
  const vk::PushConstantRange push{.stageFlags = vk::ShaderStageFlagBits::eCompute, .offset = 0, .size = push_bytes};
  return device.calls().guard(DeviceCall::create, "a kernel's layout", [&] {
    return device.handle().createPipelineLayout(vk::PipelineLayoutCreateInfo{}.setPushConstantRanges(push));
  });
}

vk::raii::Pipeline makeSideKernel(const Device& device, std::span<const std::uint32_t> spirv,
                                  std::span<const std::uint32_t> constants, const vk::raii::PipelineLayout& layout) {
  std::vector<vk::SpecializationMapEntry> entries;
  for (std::uint32_t i = 0; i < constants.size(); ++i) {
    entries.push_back({.constantID = i, .offset = i * 4, .size = 4});
  }
  const auto specialisation = vk::SpecializationInfo{}.setMapEntries(entries).setData<std::uint32_t>(constants);
  return device.calls().guard(DeviceCall::compile, "a kernel that makes what is resident", [&] {
    const vk::raii::ShaderModule module =
        device.handle().createShaderModule({.codeSize = spirv.size_bytes(), .pCode = spirv.data()});
    const vk::PipelineShaderStageCreateInfo stage{.stage = vk::ShaderStageFlagBits::eCompute,
                                                  .module = *module,
                                                  .pName = "main",
                                                  .pSpecializationInfo = &specialisation};
    return device.handle().createComputePipeline(
        nullptr, vk::ComputePipelineCreateInfo{
                     .flags = vk::PipelineCreateFlagBits::eDispatchBase, .stage = stage, .layout = *layout});
  });
}

}  // namespace blockwalk
