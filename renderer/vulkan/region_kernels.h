// SPDX-License-Identifier: Apache-2.0
// The kernels that build active regions (docs/finders.md), made when first asked for.
#pragma once

#include <algorithm>
#include <map>

#include "renderer/vulkan/device.h"
#include "shaders/region_interface.h"

namespace blockwalk {

enum class RegionKernel : std::uint8_t { macrocells, classify, surround, faces_x, faces_y, faces_z };

// The workgroups of a lattice, an invocation a cell, cut along z into slabs of at most so many cells, or of one layer
// of workgroups.
class Slabs {
 public:
  struct Slab {
    std::uint32_t x, y, z_first, z_count;  // workgroups
  };
  Slabs(glm::ivec3 cells, std::uint64_t most_cells)
      : groups_((cells + (gpu::kRegionGroupSide - 1)) / gpu::kRegionGroupSide) {
    constexpr std::uint64_t kSide = gpu::kRegionGroupSide;
    const std::uint64_t layer = std::uint64_t{groups_.x} * groups_.y * kSide * kSide * kSide;
    layers_ = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(most_cells / layer, 1, groups_.z));
  }
  bool isDone() const { return next_ >= groups_.z; }
  Slab next() {
    const std::uint32_t first = next_;
    next_ += layers_;
    return {.x = groups_.x, .y = groups_.y, .z_first = first, .z_count = std::min(layers_, groups_.z - first)};
  }

 private:
  glm::uvec3 groups_;
  std::uint32_t layers_ = 1;
  std::uint32_t next_ = 0;
};

class RegionKernels {
 public:
  explicit RegionKernels(const Device& device) : device_(device) {}

  // Runs a slab, with the kernel's push constants, and waits. What was written is there for kernels, builds and the
  // host.
  template <typename Push>
  void run(RegionKernel kernel, const Push& push, const Slabs::Slab& slab) {
    static_assert(sizeof(Push) <= kPushBytes);
    device_.submitAndWait([&](const vk::raii::CommandBuffer& commands) {
      bind(commands, kernel);
      commands.pushConstants<Push>(*layout_, vk::ShaderStageFlagBits::eCompute, 0, push);
      commands.dispatchBase(0, 0, slab.z_first, slab.x, slab.y, slab.z_count);
      makeVisible(commands);
    });
  }

 private:
  static constexpr std::uint32_t kPushBytes = 128;  // what every device has

  static void makeVisible(const vk::raii::CommandBuffer& commands);
  void bind(const vk::raii::CommandBuffer& commands, RegionKernel kernel);

  const Device& device_;
  vk::raii::PipelineLayout layout_{nullptr};
  std::map<RegionKernel, vk::raii::Pipeline> pipelines_;
};

}  // namespace blockwalk
