// SPDX-License-Identifier: Apache-2.0
// Runs the kernel over a band of a frame: one submission, timed on the device, and waits for it.
#pragma once

#include <cstdint>
#include <vulkan/vulkan_raii.hpp>

#include "renderer/plan/plan.h"
#include "renderer/vulkan/device.h"
#include "renderer/vulkan/kernels.h"

namespace blockwalk {

// Rows of the image, columns of them, and samples of those that one submission draws. Columns begin at a workgroup's.
// Rows or columns of so many pixels, filled up to whole workgroups.
int wholeGroups(int pixels);

struct Band {
  int row_begin = 0;
  int row_count = 0;
  int column_begin = 0;
  int column_count = 0;
  int sample_begin = 0;
  int sample_count = 1;
};

class BandRunner {
 public:
  // Both outlive it.
  BandRunner(Device& device, Kernels& kernels);

  // Device milliseconds. `params` is the address of the frame's gpu::FrameData, `instances` what the plan's kernel
  // queries, if it does.
  double run(const Kernels::Kernel& kernel, const Plan& plan, const Band& band, std::uint64_t params,
             vk::DescriptorSet instances);

 private:
  void record(const Kernels::Kernel& kernel, const Plan& plan, const Band& band, std::uint64_t params,
              vk::DescriptorSet instances);

  Device& device_;
  Kernels& kernels_;
  vk::raii::CommandPool pool_{nullptr};
  vk::raii::CommandBuffer commands_{nullptr};
  vk::raii::QueryPool timestamps_{nullptr};
  vk::raii::Fence fence_{nullptr};
};

}  // namespace blockwalk
