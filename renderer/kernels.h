// SPDX-License-Identifier: Apache-2.0
// Compute pipelines, one a KernelKey, made when first asked for.
#pragma once

#include <map>
#include <vulkan/vulkan_raii.hpp>

#include "renderer/device.h"
#include "renderer/plan.h"

namespace blockwalk {

class Kernels {
 public:
  explicit Kernels(const Device& device);

  const vk::raii::Pipeline& pipeline(const KernelKey& key);
  // The layout of the kernels with and without ray queries; only the former has a descriptor set.
  const vk::raii::PipelineLayout& layout(bool ray_query) const { return ray_query ? query_layout_ : plain_layout_; }
  // The one descriptor set, pointing at a top-level structure. No frame may be in flight.
  vk::DescriptorSet bindInstances(vk::AccelerationStructureKHR instances);

 private:
  vk::raii::ShaderModule makeModule(bool ray_query) const;

  const Device& device_;
  vk::raii::PipelineLayout plain_layout_{nullptr};
  vk::raii::PipelineLayout query_layout_{nullptr};
  vk::raii::DescriptorSetLayout set_layout_{nullptr};
  vk::raii::DescriptorPool descriptor_pool_{nullptr};
  vk::raii::DescriptorSet set_{nullptr};
  vk::raii::ShaderModule plain_module_{nullptr};
  vk::raii::ShaderModule query_module_{nullptr};
  vk::raii::PipelineCache cache_{nullptr};
  std::map<KernelKey, vk::raii::Pipeline> pipelines_;
};

}  // namespace blockwalk
