// SPDX-License-Identifier: Apache-2.0
// Compute pipelines, one a KernelKey, specialised and made when first asked for; and the general one, to measure them
// against.
#pragma once

#include <map>
#include <span>
#include <vulkan/vulkan_raii.hpp>

#include "renderer/plan/plan.h"
#include "renderer/vulkan/device.h"
#include "shaders/kernel_interface.h"

namespace blockwalk {

class Kernels {
 public:
  explicit Kernels(const Device& device);

  const vk::raii::Pipeline& pipeline(const KernelKey& key);
  // The kernel that reads its key when it runs: push constants at kChoicesOffset.
  const vk::raii::Pipeline& general(bool ray_query);
  static constexpr std::uint32_t kChoicesOffset = sizeof(gpu::PushConstants);
  // The layout of the kernels with and without ray queries; only the former has a descriptor set.
  const vk::raii::PipelineLayout& layout(bool ray_query) const { return ray_query ? query_layout_ : plain_layout_; }
  // The one descriptor set, pointing at a top-level structure. No frame may be in flight.
  vk::DescriptorSet bindInstances(vk::AccelerationStructureKHR instances);

 private:
  vk::raii::ShaderModule makeModule(std::span<const std::uint32_t> words) const;
  vk::raii::Pipeline makePipeline(bool ray_query, vk::ShaderModule module) const;

  const Device& device_;
  vk::raii::PipelineLayout plain_layout_{nullptr};
  vk::raii::PipelineLayout query_layout_{nullptr};
  vk::raii::DescriptorSetLayout set_layout_{nullptr};
  vk::raii::DescriptorPool descriptor_pool_{nullptr};
  vk::raii::DescriptorSet set_{nullptr};
  vk::raii::PipelineCache cache_{nullptr};
  std::map<KernelKey, vk::raii::Pipeline> pipelines_;
  std::map<bool, vk::raii::Pipeline> general_;  // by ray_query
};

}  // namespace blockwalk
