// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan/region_kernels.h"

#include <span>

#include "boundary_faces.spv.h"
#include "classify.spv.h"
#include "macrocells.spv.h"
#include "surround.spv.h"

namespace blockwalk {
namespace {

std::span<const std::uint32_t> wordsOf(RegionKernel kernel) {
  switch (kernel) {
    case RegionKernel::macrocells:
      return macrocells_spirv;
    case RegionKernel::classify:
      return classify_spirv;
    case RegionKernel::surround:
      return surround_spirv;
    default:
      return boundary_faces_spirv;
  }
}

}  // namespace

void RegionKernels::bind(const vk::raii::CommandBuffer& commands, RegionKernel kernel) {
  if (!*layout_) {
    const vk::PushConstantRange push{.stageFlags = vk::ShaderStageFlagBits::eCompute, .offset = 0, .size = kPushBytes};
    layout_ = device_.handle().createPipelineLayout(vk::PipelineLayoutCreateInfo{}.setPushConstantRanges(push));
  }
  auto found = pipelines_.find(kernel);
  if (found == pipelines_.end()) found = pipelines_.emplace(kernel, make(kernel)).first;
  commands.bindPipeline(vk::PipelineBindPoint::eCompute, *found->second);
}

vk::raii::Pipeline RegionKernels::make(RegionKernel kernel) const {
  const std::span<const std::uint32_t> words = wordsOf(kernel);
  const vk::raii::ShaderModule module =
      device_.handle().createShaderModule({.codeSize = words.size_bytes(), .pCode = words.data()});
  const std::int32_t axis = kernel == RegionKernel::faces_z ? 2 : (kernel == RegionKernel::faces_y ? 1 : 0);
  const vk::SpecializationMapEntry entry{.constantID = 0, .offset = 0, .size = sizeof axis};
  const bool directional = kernel >= RegionKernel::faces_x;
  const vk::SpecializationInfo specialisation{.mapEntryCount = directional ? 1u : 0u,
                                              .pMapEntries = directional ? &entry : nullptr,
                                              .dataSize = directional ? sizeof axis : 0,
                                              .pData = directional ? &axis : nullptr};
  return device_.handle().createComputePipeline(
      nullptr, vk::ComputePipelineCreateInfo{.stage = {.stage = vk::ShaderStageFlagBits::eCompute,
                                                       .module = *module,
                                                       .pName = "main",
                                                       .pSpecializationInfo = &specialisation},
                                             .layout = *layout_});
}

}  // namespace blockwalk
