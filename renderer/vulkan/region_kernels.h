// SPDX-License-Identifier: Apache-2.0
// The kernels that build active regions (docs/finders.md), made when first asked for.
#pragma once

#include <map>

#include "renderer/vulkan/device.h"
#include "shaders/region_interface.h"

namespace blockwalk {

enum class RegionKernel : std::uint8_t { macrocells, classify, surround, faces_x, faces_y, faces_z };

class RegionKernels {
 public:
  explicit RegionKernels(const Device& device) : device_(device) {}

  // Records a dispatch of at least one invocation a cell of a lattice, with the kernel's push constants.
  template <typename Push>
  void dispatch(const vk::raii::CommandBuffer& commands, RegionKernel kernel, const Push& push, glm::ivec3 cells) {
    static_assert(sizeof(Push) <= kPushBytes);
    bind(commands, kernel);
    commands.pushConstants<Push>(*layout_, vk::ShaderStageFlagBits::eCompute, 0, push);
    const glm::ivec3 groups = (cells + (gpu::kRegionGroupSide - 1)) / gpu::kRegionGroupSide;
    commands.dispatch(static_cast<std::uint32_t>(groups.x), static_cast<std::uint32_t>(groups.y),
                      static_cast<std::uint32_t>(groups.z));
  }

 private:
  static constexpr std::uint32_t kPushBytes = 128;  // what every device has

  void bind(const vk::raii::CommandBuffer& commands, RegionKernel kernel);

  const Device& device_;
  vk::raii::PipelineLayout layout_{nullptr};
  std::map<RegionKernel, vk::raii::Pipeline> pipelines_;
};

}  // namespace blockwalk
