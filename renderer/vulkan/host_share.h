// SPDX-License-Identifier: Apache-2.0
// Memory of the host that is kept for a volume: the budget bounds it as it does the device's.
#pragma once

#include <utility>

#include "renderer/vulkan/device.h"

namespace blockwalk {

// Move-only owner of a number of bytes that are counted, and taken elsewhere. The device outlives it.
class HostShare {
 public:
  HostShare() = default;
  // Throws OutOfDeviceMemory, as taking so many of the device does.
  HostShare(Device& device, std::uint64_t bytes) : device_(&device), bytes_(bytes) {
    device.makeRoom(bytes);
    device.memory().hostTakes(bytes);
  }
  HostShare(HostShare&& other) noexcept { *this = std::move(other); }
  HostShare& operator=(HostShare&& other) noexcept {
    std::swap(device_, other.device_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }
  ~HostShare() {
    if (device_ != nullptr) device_->memory().hostGives(bytes_);
  }

  std::uint64_t bytes() const { return bytes_; }

 private:
  Device* device_ = nullptr;
  std::uint64_t bytes_ = 0;
};

}  // namespace blockwalk
