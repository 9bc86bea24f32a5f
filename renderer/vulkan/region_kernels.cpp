// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan/region_kernels.h"

#include <span>

#include "boundary_faces.spv.h"
#include "classify.spv.h"
#include "macrocells.spv.h"
#include "renderer/vulkan/side_kernel.h"
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

void RegionKernels::makeVisible(const vk::raii::CommandBuffer& commands) {
  const vk::MemoryBarrier all{.srcAccessMask = vk::AccessFlagBits::eShaderWrite,
                              .dstAccessMask = vk::AccessFlagBits::eMemoryRead | vk::AccessFlagBits::eMemoryWrite};
  commands.pipelineBarrier(vk::PipelineStageFlagBits::eComputeShader,
                           vk::PipelineStageFlagBits::eAllCommands | vk::PipelineStageFlagBits::eHost, {}, all, {}, {});
}

void RegionKernels::bind(const vk::raii::CommandBuffer& commands, RegionKernel kernel) {
  if (!*layout_) layout_ = makePushLayout(device_, kPushBytes);
  auto found = pipelines_.find(kernel);
  if (found == pipelines_.end()) {
    const std::uint32_t axis = kernel == RegionKernel::faces_z ? 2 : (kernel == RegionKernel::faces_y ? 1 : 0);
    const std::span<const std::uint32_t> constants(&axis, kernel >= RegionKernel::faces_x ? 1 : 0);
    found = pipelines_.emplace(kernel, makeSideKernel(device_, wordsOf(kernel), constants, layout_)).first;
  }
  commands.bindPipeline(vk::PipelineBindPoint::eCompute, *found->second);
}

}  // namespace blockwalk
