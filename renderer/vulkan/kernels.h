// SPDX-License-Identifier: Apache-2.0
// The render kernels that are ready to draw, a bounded number of them, the least recently used given back first.
//
// A specialised kernel is the fastest and takes a quarter of a second of compiling. Whoever wants one picture waits for
// it. Where many share the device (DeviceOptions::background_kernels) the first view of a general kernel's family waits
// for its specialised one and the family's general one is made beside; after that no view of the family waits again:
// the general kernel, which draws the same picture, serves until the specialised one is made on a thread of its own,
// for views that are drawn more than once and that do not make an expert's choice, for which the general one stays.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <vulkan/vulkan_raii.hpp>

#include "renderer/vulkan/device.h"
#include "renderer/vulkan/kernel_layouts.h"
#include "renderer/vulkan/kernel_maker.h"

namespace blockwalk {

class Kernels {
 public:
  // `most`: that are kept, at least 2.
  Kernels(const Device& device, bool background, std::size_t most);

  struct Kernel {
    std::shared_ptr<const vk::raii::Pipeline>
        pipeline;          // held while a submission uses it: it may be given back meanwhile
    bool general = false;  // reads its key at kChoicesOffset of the push constants
  };
  // Throws OutOfDeviceMemory where there is no room to make one, after giving back all others.
  Kernel choose(const KernelKey& key, KernelWish wish);

  const vk::raii::PipelineLayout& layout(bool ray_query) const { return layouts_.layout(ray_query); }
  // The one descriptor set, pointing at a top-level structure of each level, kMostInstances at most. No frame may be in
  // flight.
  vk::DescriptorSet bindInstances(std::span<const vk::AccelerationStructureKHR> instances);

  std::size_t ready() const { return ready_.size(); }
  std::uint64_t made() const { return made_; }  // since the beginning

 private:
  using Pipeline = std::shared_ptr<const vk::raii::Pipeline>;
  Kernel chooseBest(const KernelKey& key);
  Pipeline find(const KernelName& name);
  Pipeline keep(const KernelName& name, vk::raii::Pipeline pipeline);
  Pipeline make(const KernelName& name);
  void takeMade();
  void noteFailure(const KernelMaker::Made& made);
  bool isAskedForAgain(const KernelKey& key);

  const Device& device_;
  bool background_;
  std::size_t most_;
  KernelLayouts layouts_;
  vk::raii::DescriptorPool descriptor_pool_{nullptr};
  vk::raii::DescriptorSet set_{nullptr};
  struct Ready {
    KernelName name;
    Pipeline pipeline;
  };
  std::list<Ready> ready_;  // the most recently used first
  std::map<KernelName, std::list<Ready>::iterator> by_name_;
  std::set<KernelName> families_;  // general kernels of which a view has been drawn
  std::set<KernelKey> drawn_once_;
  std::set<KernelName> failed_;  // that the maker could not make: not asked for again
  std::uint64_t made_ = 0;
  bool made_here_ = false;  // since the last call: what the compiler left behind is not given back yet
  KernelMaker maker_;       // last: it ends first
};

// Whether views get the key without asking by name for what only measuring or developing needs.
bool isCommon(const KernelKey& key, bool software);

}  // namespace blockwalk
