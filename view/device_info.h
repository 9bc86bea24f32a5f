// SPDX-License-Identifier: Apache-2.0
// What a device is and how it fails. Plain data, no Vulkan.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>

namespace blockwalk {

// The device or its driver refused, which is not the fault of input: there is no device, or one of the two below.
struct DeviceError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// The device is gone, or has not answered in the time that it has: all that was on it is lost with it.
struct DeviceLost : DeviceError {
  using DeviceError::DeviceError;
};

// It does not answer: what it was given may still be under way, write where it was told to, and keep who destroys it
// waiting.
struct DeviceHangs : DeviceLost {
  using DeviceLost::DeviceLost;
};

// What was asked for did not fit; the device serves what is smaller. The text has the bytes needed and free, where the
// driver said them; else they are 0.
struct OutOfDeviceMemory : DeviceError {
  OutOfDeviceMemory(const std::string& detail, std::uint64_t needed, std::uint64_t free, std::string member = {})
      : DeviceError(detail), needed_bytes(needed), free_bytes(free), field(std::move(member)) {}
  std::uint64_t needed_bytes = 0;
  std::uint64_t free_bytes = 0;
  std::string field;  // the view's member of which another value needs less; empty: none is known
};

struct DeviceInfo {
  std::string name;
  std::string driver;
  std::string driver_version;
  std::string api_version;
  std::string kind;  // discrete, integrated, virtual, software
  bool ray_query = false;
  int subgroup_size = 0;  // lanes; of a software driver its vectors of 32-bit words
  std::uint64_t memory_budget_bytes = 0;
  std::uint64_t memory_used_bytes = 0;  // by this renderer
};

}  // namespace blockwalk
