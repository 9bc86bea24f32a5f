// SPDX-License-Identifier: Apache-2.0
// How a device fails. Every allocation, every submission, every wait and every pipeline goes through DeviceCalls, where
// a test can make any of them fail as a driver would; and every error of Vulkan becomes one of view/device_info.h.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <string_view>
#include <vulkan/vulkan_raii.hpp>

#include "view/device_info.h"
#include "view/device_options.h"

namespace blockwalk {

// The error of view/device_info.h that a Vulkan error is: DeviceLost, OutOfDeviceMemory (of the device or the host, or
// of something that is as limited), or else DeviceError. `doing` says what failed.
[[noreturn]] void throwDeviceError(vk::Result result, const std::string& doing);

class DeviceCalls {
 public:
  DeviceCalls(std::string device_name, const DeviceOptions& options, bool software);

  // Before a call: throws what a test wants of it, and DeviceLost once the device is lost.
  void before(DeviceCall call, std::string_view doing);
  template <typename Work>
  auto guard(DeviceCall call, std::string_view doing, Work&& work) {
    before(call, doing);
    return translate(doing, work);
  }
  // `work` with Vulkan's errors as ours. A lost device stays lost.
  template <typename Work>
  auto translate(std::string_view doing, Work&& work) {
    try {
      return work();
    } catch (const vk::SystemError& error) {
      fail(static_cast<vk::Result>(error.code().value()), doing);
    }
  }
  // Until the fence is signalled. One that is not within the bound is that of a kernel that hangs: DeviceHangs.
  void wait(const vk::raii::Device& device, vk::Fence fence);

  bool isLost() const { return lost_; }
  // What was submitted may still be under way, and use what it was given.
  bool hangs() const { return hangs_; }

 private:
  [[noreturn]] void fail(vk::Result result, std::string_view doing);

  std::string device_name_;
  std::function<DeviceFault(DeviceCall)> inject_;
  std::chrono::milliseconds longest_wait_;
  bool lost_ = false;
  bool hangs_ = false;
};

}  // namespace blockwalk
