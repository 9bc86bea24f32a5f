// SPDX-License-Identifier: Apache-2.0
// The Vulkan device: one compute queue, the features the kernels need, and validation when asked for.
#pragma once

#include <memory>
#include <utility>
#include <vulkan/vulkan_raii.hpp>

#include "renderer/vulkan/device_calls.h"
#include "renderer/vulkan/memory.h"
#include "view/device_info.h"
#include "view/device_options.h"

namespace blockwalk {

class Device {
 public:
  // Throws DeviceError: no Vulkan driver, no device of that name, or one that lacks a feature (the text says which).
  explicit Device(const DeviceOptions& options);
  // Another logical device of the same driver and processor, with a queue of its own. `beside` outlives it.
  Device(const Device& beside, const DeviceOptions& options);
  Device& operator=(const Device&) = delete;

  const vk::raii::Device& handle() const { return device_; }
  std::uint32_t queueFamily() const { return queue_family_; }
  DeviceInfo info() const;
  const std::string& name() const { return info_.name; }
  bool rayQuery() const { return info_.ray_query; }
  bool isSoftware() const { return info_.kind == "software"; }
  double timestampPeriodNs() const { return timestamp_period_ns_; }
  std::uint64_t timestampMask() const { return timestamp_mask_; }
  std::uint64_t maxAllocationBytes() const { return max_allocation_bytes_; }
  std::uint32_t maxInstances() const { return max_instances_; }
  std::uint64_t maxPrimitives() const { return max_primitives_; }  // of a bottom-level structure
  std::uint32_t scratchAlignment() const { return scratch_alignment_; }

  // Index of a memory type among `type_bits` with all of `required`, preferring `preferred`; throws DeviceError.
  std::uint32_t memoryType(std::uint32_t type_bits, vk::MemoryPropertyFlags required,
                           vk::MemoryPropertyFlags preferred) const;

  void note(const std::string& text) const;
  Memory& memory() { return *memory_; }
  const Memory& memory() const { return *memory_; }
  DeviceCalls& calls() const { return *calls_; }

  // Every submission of the device; `fence` is not signalled. Throws as DeviceCalls::guard() does.
  void submit(const vk::raii::CommandBuffer& commands, vk::Fence fence) const;
  void wait(vk::Fence fence) const { calls_->wait(device_, fence); }

  // Before so many bytes are taken: whoever keeps what nobody uses is asked to give back what the budget lacks. Throws
  // OutOfDeviceMemory where that is not enough.
  void makeRoom(std::uint64_t bytes);
  // Of the budget and of what the driver or the host has, without what would give way.
  std::uint64_t freeBytes() const;
  // Gives back at least so many bytes if it can, and says how many.
  using Reclaim = std::function<std::uint64_t(std::uint64_t bytes)>;
  void onShortage(Reclaim reclaim) { reclaim_ = std::move(reclaim); }
  // Asks for them: true where some came back.
  bool reclaim(std::uint64_t bytes) { return reclaim_ && reclaim_(bytes) > 0; }

  // Records with `record`, submits, and waits. For set-up work; frames have their own command buffers.
  template <typename Record>
  void submitAndWait(Record&& record) const {
    vk::raii::CommandBuffer commands = beginCommands();
    record(std::as_const(commands));
    endAndWait(commands);
  }

 private:
  std::uint64_t freeOfBudget() const;
  vk::raii::CommandBuffer beginCommands() const;
  void endAndWait(vk::raii::CommandBuffer& commands) const;
  void createInstance(const DeviceOptions& options);
  void createDevice(const DeviceOptions& options);
  void chooseQueue();
  void createLogical(bool has_budget);
  void readLimits(const DeviceOptions& options);
  void checkVectors() const;

  std::function<void(const std::string&)> on_message_;
  Reclaim reclaim_;
  vk::raii::Context context_;
  vk::raii::Instance instance_{nullptr};
  vk::raii::DebugUtilsMessengerEXT messenger_{nullptr};
  vk::raii::PhysicalDevice physical_{nullptr};
  vk::raii::Device device_{nullptr};
  std::unique_ptr<DeviceCalls> calls_;
  std::unique_ptr<Memory> memory_;
  vk::raii::Queue queue_{nullptr};
  vk::raii::CommandPool pool_{nullptr};
  DeviceInfo info_;
  std::uint32_t queue_family_ = 0;
  std::uint64_t timestamp_mask_ = 0;
  double timestamp_period_ns_ = 1;
  std::uint64_t max_allocation_bytes_ = 0;
  std::uint32_t max_instances_ = 0;
  std::uint64_t max_primitives_ = 0;
  std::uint32_t scratch_alignment_ = 1;
};

}  // namespace blockwalk
