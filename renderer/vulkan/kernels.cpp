// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan/kernels.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <array>
#include <new>
#include <utility>

#include "volume/error.h"

namespace blockwalk {
namespace {

constexpr std::size_t kMostDrawnOnce = 1024;

}  // namespace

bool isCommon(const KernelKey& key, bool software) {
  const bool finder = key.finder == gpu::kFinderGrid || (key.finder == gpu::kFinderQuery && !software);
  const bool output = key.output == gpu::kOutputColor || key.output == gpu::kOutputPoint;
  return finder && output && key.walk != 0 && key.probe == 0 && key.mode != gpu::kModeBlocks;
}

Kernels::Kernels(const Device& device, bool background, std::size_t most)
    : device_(device),
      background_(background),
      most_(most),
      layouts_(device.handle(), device.rayQuery()),
      maker_(device, layouts_) {
  BLOCKWALK_CHECK(most, >=, 2u);
  if (!device.rayQuery()) return;
  const auto& handle = device.handle();
  const vk::DescriptorPoolSize size{.type = vk::DescriptorType::eAccelerationStructureKHR,
                                    .descriptorCount = kMostInstances};
  descriptor_pool_ = handle.createDescriptorPool(
      vk::DescriptorPoolCreateInfo{.flags = vk::DescriptorPoolCreateFlagBits::eFreeDescriptorSet, .maxSets = 1}
          .setPoolSizes(size));
  set_ = std::move(handle.allocateDescriptorSets(
      vk::DescriptorSetAllocateInfo{.descriptorPool = *descriptor_pool_}.setSetLayouts(*layouts_.set()))[0]);
}

vk::DescriptorSet Kernels::bindInstances(std::span<const vk::AccelerationStructureKHR> instances) {
  std::array<vk::AccelerationStructureKHR, kMostInstances> all;
  BLOCKWALK_CHECK(instances.size(), <=, all.size());
  // The rest are not looked at, and must be something.
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = instances[std::min(i, instances.size() - 1)];
  const vk::WriteDescriptorSetAccelerationStructureKHR structure{.accelerationStructureCount = kMostInstances,
                                                                 .pAccelerationStructures = all.data()};
  const vk::WriteDescriptorSet write{.pNext = &structure,
                                     .dstSet = *set_,
                                     .dstBinding = 0,
                                     .descriptorCount = kMostInstances,
                                     .descriptorType = vk::DescriptorType::eAccelerationStructureKHR};
  device_.handle().updateDescriptorSets(write, {});
  return *set_;
}

Kernels::Kernel Kernels::choose(const KernelKey& key, KernelWish wish) {
  takeMade();
  if (background_ && std::exchange(made_here_, false)) malloc_trim(0);  // its first dispatch is over
  if (wish == KernelWish::general) return {.pipeline = make(generalKernel(key)), .general = true};
  if (wish == KernelWish::specialised || !background_) return {.pipeline = make({.key = key}), .general = false};
  return chooseBest(key);
}

Kernels::Kernel Kernels::chooseBest(const KernelKey& key) {
  const KernelName special{.key = key};
  const KernelName general = generalKernel(key);
  if (Pipeline found = find(special)) return {.pipeline = std::move(found), .general = false};
  const bool common = isCommon(key, device_.isSoftware());
  if (Pipeline found = find(general)) {
    if (common && isAskedForAgain(key) && !failed_.contains(special)) maker_.ask(special);
    return {.pipeline = std::move(found), .general = true};
  }
  if (common && families_.insert(general).second) {
    Pipeline made = make(special);
    maker_.ask(general);
    return {.pipeline = std::move(made), .general = false};
  }
  return {.pipeline = make(general), .general = true};
}

bool Kernels::isAskedForAgain(const KernelKey& key) {
  if (drawn_once_.contains(key)) return true;
  if (drawn_once_.size() == kMostDrawnOnce) drawn_once_.clear();
  drawn_once_.insert(key);
  return false;
}

Kernels::Pipeline Kernels::find(const KernelName& name) {
  const auto found = by_name_.find(name);
  if (found == by_name_.end()) return nullptr;
  ready_.splice(ready_.begin(), ready_, found->second);
  return ready_.front().pipeline;
}

Kernels::Pipeline Kernels::keep(const KernelName& name, vk::raii::Pipeline pipeline) {
  ++made_;
  while (ready_.size() >= most_) {
    by_name_.erase(ready_.back().name);
    ready_.pop_back();
  }
  ready_.push_front({.name = name, .pipeline = std::make_shared<const vk::raii::Pipeline>(std::move(pipeline))});
  by_name_.emplace(name, ready_.begin());
  return ready_.front().pipeline;
}

Kernels::Pipeline Kernels::make(const KernelName& name) {
  maker_.claim(name);
  takeMade();
  if (Pipeline found = find(name)) return found;
  try {
    device_.memory().requireOfHost(kKernelBytes, "a kernel");
  } catch (const OutOfDeviceMemory&) {
    // Kernels can be made again. A driver may give their memory back with the next submission: then the next asks.
    by_name_.clear();
    ready_.clear();
    device_.memory().requireOfHost(kKernelBytes, "a kernel");
  }
  made_here_ = true;
  return keep(name, device_.calls().guard(DeviceCall::compile, "a kernel",
                                          [&] { return layouts_.make(name, kernelWords(name)); }));
}

// One that memory was not there for is asked for again with the next frame that wants it.
void Kernels::noteFailure(const KernelMaker::Made& made) {
  try {
    std::rethrow_exception(made.failure);
  } catch (const OutOfDeviceMemory&) {
  } catch (const std::bad_alloc&) {
  } catch (const std::exception& error) {
    if (!failed_.insert(made.name).second) return;
    device_.note(fmt::format("{}: no kernel '{}': {}", device_.name(), describe(made.name.key), error.what()));
  }
}

void Kernels::takeMade() {
  for (KernelMaker::Made& made : maker_.take()) {
    if (made.pipeline) {
      if (!by_name_.contains(made.name)) keep(made.name, std::move(*made.pipeline));
    } else {
      noteFailure(made);
    }
  }
}

}  // namespace blockwalk
