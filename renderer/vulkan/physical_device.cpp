// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan/physical_device.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <string_view>
#include <vector>

namespace blockwalk {
namespace {

std::string kindName(vk::PhysicalDeviceType type) {
  switch (type) {
    case vk::PhysicalDeviceType::eDiscreteGpu:
      return "discrete";
    case vk::PhysicalDeviceType::eIntegratedGpu:
      return "integrated";
    case vk::PhysicalDeviceType::eVirtualGpu:
      return "virtual";
    default:
      return "software";
  }
}

int kindRank(vk::PhysicalDeviceType type) {
  switch (type) {
    case vk::PhysicalDeviceType::eDiscreteGpu:
      return 0;
    case vk::PhysicalDeviceType::eIntegratedGpu:
      return 1;
    case vk::PhysicalDeviceType::eVirtualGpu:
      return 2;
    default:
      return 3;
  }
}

bool supportsRayQuery(const vk::raii::PhysicalDevice& device) {
  if (!hasExtensions(device, kRayQueryExtensions)) return false;
  const auto features =
      device.getFeatures2<vk::PhysicalDeviceFeatures2, vk::PhysicalDeviceAccelerationStructureFeaturesKHR,
                          vk::PhysicalDeviceRayQueryFeaturesKHR>();
  return features.get<vk::PhysicalDeviceAccelerationStructureFeaturesKHR>().accelerationStructure &&
         features.get<vk::PhysicalDeviceRayQueryFeaturesKHR>().rayQuery;
}

// What the kernels need and the device lacks; empty when it will do.
std::string missingFeatures(const vk::raii::PhysicalDevice& device) {
  const auto properties = device.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceVulkan11Properties>();
  if (properties.get<vk::PhysicalDeviceProperties2>().properties.apiVersion < VK_API_VERSION_1_2) return "Vulkan 1.2";
  const auto features = device.getFeatures2<vk::PhysicalDeviceFeatures2, vk::PhysicalDeviceVulkan12Features>();
  const auto& core = features.get<vk::PhysicalDeviceFeatures2>().features;
  const auto& v12 = features.get<vk::PhysicalDeviceVulkan12Features>();
  const auto operations = properties.get<vk::PhysicalDeviceVulkan11Properties>().subgroupSupportedOperations;
  std::string missing;
  const auto need = [&](bool present, std::string_view name) {
    if (!present) missing += fmt::format("{}{}", missing.empty() ? "" : ", ", name);
  };
  need(core.shaderInt64, "shaderInt64");
  need(v12.storageBuffer8BitAccess, "storageBuffer8BitAccess");
  need(v12.shaderInt8, "shaderInt8");
  need(v12.bufferDeviceAddress, "bufferDeviceAddress");
  need(v12.scalarBlockLayout, "scalarBlockLayout");
  need(v12.hostQueryReset, "hostQueryReset");
  need(static_cast<bool>(operations & vk::SubgroupFeatureFlagBits::eArithmetic), "subgroup arithmetic");
  return missing;
}

DeviceInfo describe(const vk::raii::PhysicalDevice& device) {
  const auto properties = device.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceDriverProperties,
                                                vk::PhysicalDeviceVulkan11Properties>();
  const auto& core = properties.get<vk::PhysicalDeviceProperties2>().properties;
  const auto& driver = properties.get<vk::PhysicalDeviceDriverProperties>();
  DeviceInfo info;
  info.name = core.deviceName.data();
  info.driver = driver.driverName.data();
  info.driver_version = driver.driverInfo.data();
  info.api_version = fmt::format("{}.{}.{}", VK_API_VERSION_MAJOR(core.apiVersion),
                                 VK_API_VERSION_MINOR(core.apiVersion), VK_API_VERSION_PATCH(core.apiVersion));
  info.kind = kindName(core.deviceType);
  info.ray_query = supportsRayQuery(device);
  info.subgroup_size = static_cast<int>(properties.get<vk::PhysicalDeviceVulkan11Properties>().subgroupSize);
  const auto memory = device.getMemoryProperties();
  for (std::uint32_t i = 0; i < memory.memoryHeapCount; ++i) {
    if (memory.memoryHeaps[i].flags & vk::MemoryHeapFlagBits::eDeviceLocal) {
      info.memory_budget_bytes = std::max<std::uint64_t>(info.memory_budget_bytes, memory.memoryHeaps[i].size);
    }
  }
  return info;
}

std::vector<vk::raii::PhysicalDevice> sortedDevices(const vk::raii::Instance& instance) {
  std::vector<vk::raii::PhysicalDevice> devices = vk::raii::PhysicalDevices(instance);
  std::ranges::stable_sort(devices, {}, [](const auto& d) { return kindRank(d.getProperties().deviceType); });
  return devices;
}

}  // namespace

bool hasExtensions(const vk::raii::PhysicalDevice& device, std::span<const char* const> names) {
  const auto available = device.enumerateDeviceExtensionProperties();
  return std::ranges::all_of(names, [&](std::string_view name) {
    return std::ranges::any_of(available, [&](const auto& e) { return name == e.extensionName.data(); });
  });
}

PhysicalDevice choosePhysicalDevice(const vk::raii::Instance& instance, const std::string& wanted) {
  const auto devices = sortedDevices(instance);
  std::string seen;
  std::size_t wanted_index = devices.size();
  const bool by_index = !wanted.empty() && std::ranges::all_of(wanted, [](char c) { return c >= '0' && c <= '9'; });
  if (by_index) std::from_chars(wanted.data(), wanted.data() + wanted.size(), wanted_index);
  for (std::size_t i = 0; i < devices.size(); ++i) {
    const DeviceInfo info = describe(devices[i]);
    const std::string missing = missingFeatures(devices[i]);
    seen += fmt::format("\n  {}: {} ({}){}", i, info.name, info.kind, missing.empty() ? "" : ", lacks " + missing);
    if (by_index ? i != wanted_index : info.name.find(wanted) == std::string::npos) continue;
    if (!missing.empty()) continue;
    return {.handle = devices[i], .info = info};
  }
  throw DeviceError(fmt::format("no usable Vulkan device{}; there are:{}",
                                wanted.empty() ? std::string() : fmt::format(" matches '{}'", wanted),
                                seen.empty() ? " none" : seen));
}

}  // namespace blockwalk
