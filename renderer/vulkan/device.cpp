// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan/device.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string_view>

#include "renderer/vulkan/physical_device.h"

namespace blockwalk {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

// A generic function object: vulkan.hpp changed the callback's parameter types between its versions.
constexpr auto receiveMessage = [](auto, auto, const auto* data, void* user) -> VkBool32 {
  const auto& sink = *static_cast<const std::function<void(const std::string&)>*>(user);
  if (sink) sink(fmt::format("validation: {}", data->pMessage));
  return VK_FALSE;
};

}  // namespace

Device::Device(const DeviceOptions& options) : on_message_(options.on_message) {
  try {
    createInstance(options);
    PhysicalDevice chosen = choosePhysicalDevice(instance_, options.device);
    physical_ = std::move(chosen.handle);
    info_ = std::move(chosen.info);
    info_.ray_query = info_.ray_query && options.allow_ray_query;
    if (options.memory_budget_bytes > 0) info_.memory_budget_bytes = options.memory_budget_bytes;
    createDevice(options);
    checkVectors();
  } catch (const vk::SystemError& error) {
    throw DeviceError(
        fmt::format("Vulkan did not start: {}. Is a driver installed (Mesa's lavapipe will do)?", error.what()));
  }
}

void Device::createInstance(const DeviceOptions& options) {
  const vk::ApplicationInfo application{.pApplicationName = "blockwalk", .apiVersion = VK_API_VERSION_1_2};
  std::vector<const char*> layers;
  std::vector<const char*> extensions;
  if (options.validation) {
    const auto available = context_.enumerateInstanceLayerProperties();
    if (std::ranges::none_of(available,
                             [](const auto& l) { return std::string_view(l.layerName.data()) == kValidationLayer; })) {
      throw DeviceError(fmt::format("validation was asked for, and the layer {} is not installed", kValidationLayer));
    }
    layers.push_back(kValidationLayer);
    extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
    extensions.push_back(VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME);
  }
  const std::array enabled{vk::ValidationFeatureEnableEXT::eSynchronizationValidation};
  const vk::ValidationFeaturesEXT validation{.enabledValidationFeatureCount = enabled.size(),
                                             .pEnabledValidationFeatures = enabled.data()};
  instance_ = vk::raii::Instance(
      context_, vk::InstanceCreateInfo{.pNext = options.validation ? &validation : nullptr,
                                       .pApplicationInfo = &application,
                                       .enabledLayerCount = static_cast<std::uint32_t>(layers.size()),
                                       .ppEnabledLayerNames = layers.data(),
                                       .enabledExtensionCount = static_cast<std::uint32_t>(extensions.size()),
                                       .ppEnabledExtensionNames = extensions.data()});
  if (!options.validation) return;
  using Severity = vk::DebugUtilsMessageSeverityFlagBitsEXT;
  using Type = vk::DebugUtilsMessageTypeFlagBitsEXT;
  messenger_ = vk::raii::DebugUtilsMessengerEXT(
      instance_, vk::DebugUtilsMessengerCreateInfoEXT{.messageSeverity = Severity::eError | Severity::eWarning,
                                                      .messageType = Type::eValidation | Type::ePerformance,
                                                      .pfnUserCallback = receiveMessage,
                                                      .pUserData = &on_message_});
}

Device::Device(const Device& beside, const DeviceOptions& options)
    : on_message_(beside.on_message_), physical_(beside.physical_), info_(beside.info_) {
  createDevice(options);
}

void Device::createDevice(const DeviceOptions& options) {
  chooseQueue();
  const bool has_budget = hasExtensions(physical_, std::array{VK_EXT_MEMORY_BUDGET_EXTENSION_NAME});
  createLogical(has_budget);
  calls_ = std::make_unique<DeviceCalls>(info_.name, options, isSoftware());
  memory_ = std::make_unique<Memory>(physical_, device_, *calls_, isSoftware(), has_budget);
  queue_ = device_.getQueue(queue_family_, 0);
  pool_ = device_.createCommandPool(
      {.flags = vk::CommandPoolCreateFlagBits::eTransient, .queueFamilyIndex = queue_family_});
  readLimits(options);
}

void Device::chooseQueue() {
  const auto families = physical_.getQueueFamilyProperties();
  const auto family = std::ranges::find_if(families, [](const auto& f) {
    return static_cast<bool>(f.queueFlags & vk::QueueFlagBits::eCompute) && f.timestampValidBits > 0;
  });
  if (family == families.end()) throw DeviceError(fmt::format("{}: no compute queue with timestamps", info_.name));
  queue_family_ = static_cast<std::uint32_t>(family - families.begin());
  timestamp_mask_ =
      family->timestampValidBits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << family->timestampValidBits) - 1;
}

// With the features that missingFeatures() asks for, and ray queries where they may be used.
void Device::createLogical(bool has_budget) {
  vk::StructureChain<vk::DeviceCreateInfo, vk::PhysicalDeviceFeatures2, vk::PhysicalDeviceVulkan12Features,
                     vk::PhysicalDeviceAccelerationStructureFeaturesKHR, vk::PhysicalDeviceRayQueryFeaturesKHR>
      chain;
  auto& core = chain.get<vk::PhysicalDeviceFeatures2>().features;
  core.shaderInt64 = VK_TRUE;
  auto& v12 = chain.get<vk::PhysicalDeviceVulkan12Features>();
  v12.storageBuffer8BitAccess = v12.shaderInt8 = v12.bufferDeviceAddress = v12.scalarBlockLayout = v12.hostQueryReset =
      VK_TRUE;
  chain.get<vk::PhysicalDeviceAccelerationStructureFeaturesKHR>().accelerationStructure = VK_TRUE;
  chain.get<vk::PhysicalDeviceRayQueryFeaturesKHR>().rayQuery = VK_TRUE;
  if (!info_.ray_query) {
    chain.unlink<vk::PhysicalDeviceAccelerationStructureFeaturesKHR>();
    chain.unlink<vk::PhysicalDeviceRayQueryFeaturesKHR>();
  }
  const float priority = 1;
  const vk::DeviceQueueCreateInfo queue{
      .queueFamilyIndex = queue_family_, .queueCount = 1, .pQueuePriorities = &priority};
  auto& create = chain.get<vk::DeviceCreateInfo>();
  create.setQueueCreateInfos(queue);
  std::vector<const char*> extensions;
  if (info_.ray_query) extensions.assign(kRayQueryExtensions.begin(), kRayQueryExtensions.end());
  if (has_budget) extensions.push_back(VK_EXT_MEMORY_BUDGET_EXTENSION_NAME);
  create.setPEnabledExtensionNames(extensions);
  device_ = vk::raii::Device(physical_, create);
}

void Device::readLimits(const DeviceOptions& options) {
  const auto properties = physical_.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceVulkan11Properties,
                                                   vk::PhysicalDeviceAccelerationStructurePropertiesKHR>();
  timestamp_period_ns_ = properties.get<vk::PhysicalDeviceProperties2>().properties.limits.timestampPeriod;
  max_allocation_bytes_ = properties.get<vk::PhysicalDeviceVulkan11Properties>().maxMemoryAllocationSize;
  const auto& acceleration = properties.get<vk::PhysicalDeviceAccelerationStructurePropertiesKHR>();
  max_instances_ = static_cast<std::uint32_t>(std::min<std::uint64_t>(acceleration.maxInstanceCount, 0xffffffffu));
  max_primitives_ = std::min<std::uint64_t>(acceleration.maxPrimitiveCount, options.max_primitives);
  scratch_alignment_ = std::max(1u, acceleration.minAccelerationStructureScratchOffsetAlignment);
}

// That lavapipe took the width it was asked for (renderer/driver.h).
void Device::checkVectors() const {
  const char* asked = std::getenv("LP_NATIVE_VECTOR_WIDTH");
  if (asked == nullptr || info_.driver != "llvmpipe") return;
  const long bits = std::strtol(asked, nullptr, 10);
  if (bits != 32L * info_.subgroup_size) {
    note(fmt::format("{}: vectors of {} bits were asked for, and it has subgroups of {} lanes", info_.name, asked,
                     info_.subgroup_size));
  }
}

std::uint32_t Device::memoryType(std::uint32_t type_bits, vk::MemoryPropertyFlags required,
                                 vk::MemoryPropertyFlags preferred) const {
  const vk::PhysicalDeviceMemoryProperties memory = physical_.getMemoryProperties();
  for (const vk::MemoryPropertyFlags flags : {required | preferred, required}) {
    for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i) {
      if ((type_bits >> i & 1u) != 0 && (memory.memoryTypes[i].propertyFlags & flags) == flags) return i;
    }
  }
  throw DeviceError(fmt::format("{}: no memory type with {}", info_.name, vk::to_string(required)));
}

std::uint64_t Device::freeOfBudget() const {
  return info_.memory_budget_bytes - std::min(info_.memory_budget_bytes, memory_->usedBytes());
}

std::uint64_t Device::freeBytes() const { return std::min(freeOfBudget(), memory_->freeBytes()); }

void Device::makeRoom(std::uint64_t bytes) {
  const std::uint64_t budget = info_.memory_budget_bytes;
  const auto free = [&] { return bytes > Memory::kMostSmallBytes ? freeBytes() : freeOfBudget(); };
  for (std::uint64_t left = free(); bytes > left; left = free()) {
    // What can never fit is refused before anything gives way for it.
    if (bytes <= budget && reclaim(bytes - left)) continue;
    throw OutOfDeviceMemory(fmt::format("{}: {} bytes are needed, {} are free, {} of {} in use", info_.name, bytes,
                                        left, memory_->usedBytes(), budget),
                            bytes, left);
  }
}

void Device::note(const std::string& text) const {
  if (on_message_) on_message_(text);
}

vk::raii::CommandBuffer Device::beginCommands() const {
  auto buffers = device_.allocateCommandBuffers({.commandPool = *pool_, .commandBufferCount = 1});
  buffers[0].begin({.flags = vk::CommandBufferUsageFlagBits::eOneTimeSubmit});
  return std::move(buffers[0]);
}

void Device::endAndWait(vk::raii::CommandBuffer& commands) const {
  commands.end();
  vk::raii::Fence fence = calls_->guard(DeviceCall::create, "a fence", [&] { return device_.createFence({}); });
  submit(commands, *fence);
  try {
    wait(*fence);
  } catch (const DeviceHangs&) {
    // What is still under way uses them: they are left behind with it.
    [[maybe_unused]] const auto left_fence = fence.release();
    [[maybe_unused]] const auto left_commands = commands.release();
    throw;
  }
}

void Device::submit(const vk::raii::CommandBuffer& commands, vk::Fence fence) const {
  calls_->guard(DeviceCall::submit, "a submission",
                [&] { queue_.submit(vk::SubmitInfo{}.setCommandBuffers(*commands), fence); });
}

DeviceInfo Device::info() const {
  DeviceInfo info = info_;
  info.memory_used_bytes = memory_->usedBytes();
  return info;
}

}  // namespace blockwalk
