// SPDX-License-Identifier: Apache-2.0
// What render kernels are bound to, and the making of one: for the device that draws, and for one that only compiles.
#pragma once

#include <compare>
#include <cstdint>
#include <vector>
#include <vulkan/vulkan_raii.hpp>

#include "renderer/plan/kernel_key.h"
#include "shaders/kernel_interface.h"

namespace blockwalk {

// A kernel: specialised for all of its key, or general, with the late choices (shaders/kernel_interface.h) at run time.
struct KernelName {
  KernelKey key;
  bool general = false;
  auto operator<=>(const KernelName&) const = default;
};
// All kernels that differ in late choices alone have one.
KernelName generalKernel(KernelKey key);

// Its SPIR-V, some 35 ms of SPIRV-Tools; any thread. Throws DeviceError.
std::vector<std::uint32_t> kernelWords(const KernelName& name);

// Top-level structures that a kernel with ray queries is bound to: of the levels that a frame is drawn of.
constexpr std::uint32_t kMostInstances = gpu::kMaxFarLevels + 1;

class KernelLayouts {
 public:
  KernelLayouts(const vk::raii::Device& device, bool ray_query);

  // Layouts of the kernels with and without ray queries; only the former have a descriptor set.
  const vk::raii::PipelineLayout& layout(bool ray_query) const { return ray_query ? query_ : plain_; }
  const vk::raii::DescriptorSetLayout& set() const { return set_; }
  // Any thread.
  vk::raii::Pipeline make(const KernelName& name, const std::vector<std::uint32_t>& words) const;

 private:
  const vk::raii::Device& device_;
  vk::raii::DescriptorSetLayout set_{nullptr};
  vk::raii::PipelineLayout plain_{nullptr};
  vk::raii::PipelineLayout query_{nullptr};
};

// That a driver takes for one at most. What its compiler takes meanwhile is in the reserve
// (renderer/vulkan/memory.cpp).
constexpr std::uint64_t kKernelBytes = std::uint64_t{16} << 20;

// Of push constants: where a general kernel reads its key.
constexpr std::uint32_t kChoicesOffset = sizeof(gpu::PushConstants);

}  // namespace blockwalk
