// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan/device_calls.h"

#include <fmt/format.h>

#include <algorithm>
#include <thread>

namespace blockwalk {
namespace {

// A band takes DeviceOptions::band_ms. Software shares its processor with whatever else runs there, and lavapipe
// compiles a kernel in its first dispatch.
constexpr std::chrono::seconds kLongestWait{20};
constexpr std::chrono::seconds kLongestSoftwareWait{300};

}  // namespace

void throwDeviceError(vk::Result result, const std::string& doing) {
  const std::string text = fmt::format("{}: {}", doing, vk::to_string(result));
  switch (result) {
    case vk::Result::eErrorDeviceLost:
      throw DeviceLost(text);
    case vk::Result::eErrorOutOfDeviceMemory:
    case vk::Result::eErrorOutOfHostMemory:
    case vk::Result::eErrorOutOfPoolMemory:
    case vk::Result::eErrorFragmentation:
    case vk::Result::eErrorTooManyObjects:
      throw OutOfDeviceMemory(text, 0, 0);
    default:
      throw DeviceError(text);
  }
}

DeviceCalls::DeviceCalls(std::string device_name, const DeviceOptions& options, bool software)
    : device_name_(std::move(device_name)),
      inject_(options.inject_fault),
      longest_wait_(options.longest_wait.value_or(software ? kLongestSoftwareWait : kLongestWait)) {}

void DeviceCalls::before(DeviceCall call, std::string_view doing) {
  if (lost_) throw DeviceLost(fmt::format("{}: {}: the device was lost before", device_name_, doing));
  const DeviceFault fault = inject_ ? inject_(call) : DeviceFault::none;
  if (fault == DeviceFault::out_of_memory) fail(vk::Result::eErrorOutOfDeviceMemory, doing);
  if (fault == DeviceFault::lost) fail(vk::Result::eErrorDeviceLost, doing);
}

void DeviceCalls::fail(vk::Result result, std::string_view doing) {
  lost_ = lost_ || result == vk::Result::eErrorDeviceLost;
  throwDeviceError(result, fmt::format("{}: {}", device_name_, doing));
}

void DeviceCalls::wait(const vk::raii::Device& device, vk::Fence fence) {
  constexpr std::chrono::nanoseconds kSlice = std::chrono::seconds(1);
  constexpr std::string_view kDoing = "a dispatch";
  if (lost_) before(DeviceCall::wait, kDoing);
  const auto end = std::chrono::steady_clock::now() + longest_wait_;
  // Short of memory a driver may fail to wait. What was submitted is under way all the same, and nothing that it uses
  // may be given back before it ends.
  vk::Result failure = vk::Result::eSuccess;
  for (;;) {
    const auto left =
        std::max(std::chrono::nanoseconds(end - std::chrono::steady_clock::now()), std::chrono::nanoseconds(0));
    const auto slice = static_cast<std::uint64_t>(std::min(left, kSlice).count());
    try {
      if (device.waitForFences(fence, VK_TRUE, slice) == vk::Result::eSuccess) break;
    } catch (const vk::SystemError& error) {
      failure = static_cast<vk::Result>(error.code().value());
      if (failure == vk::Result::eErrorDeviceLost) fail(failure, kDoing);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    if (left.count() > 0) continue;
    lost_ = hangs_ = true;
    throw DeviceHangs(fmt::format("{}: a kernel hangs: no answer in {} ms", device_name_, longest_wait_.count()));
  }
  if (failure != vk::Result::eSuccess) fail(failure, kDoing);
  before(DeviceCall::wait, kDoing);
}

}  // namespace blockwalk
