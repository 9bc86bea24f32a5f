// SPDX-License-Identifier: Apache-2.0
// Which of the machine's devices is drawn with, and what it can do.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vulkan/vulkan_raii.hpp>

#include "view/device_info.h"

namespace blockwalk {

inline constexpr std::array kRayQueryExtensions{VK_KHR_ACCELERATION_STRUCTURE_EXTENSION_NAME,
                                                VK_KHR_RAY_QUERY_EXTENSION_NAME,
                                                VK_KHR_DEFERRED_HOST_OPERATIONS_EXTENSION_NAME};

bool hasExtensions(const vk::raii::PhysicalDevice& device, std::span<const char* const> names);

struct PhysicalDevice {
  vk::raii::PhysicalDevice handle;
  DeviceInfo info;
};

// The first that will do, discrete before integrated before software; or the one that is `wanted`, by a part of its
// name or by its index. Throws DeviceError, which lists what there is and what it lacks.
PhysicalDevice choosePhysicalDevice(const vk::raii::Instance& instance, const std::string& wanted);

}  // namespace blockwalk
