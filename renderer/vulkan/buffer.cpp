// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan/buffer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

namespace blockwalk {
namespace {

constexpr std::uint64_t kStagingBytes = std::uint64_t{32} << 20;

struct UseFlags {
  vk::BufferUsageFlags usage;
  vk::MemoryPropertyFlags required;
  vk::MemoryPropertyFlags preferred;
};

UseFlags flagsOf(BufferUse use) {
  using Usage = vk::BufferUsageFlagBits;
  using Memory = vk::MemoryPropertyFlagBits;
  const auto host = Memory::eHostVisible | Memory::eHostCoherent;
  switch (use) {
    case BufferUse::resident:
      return {Usage::eStorageBuffer | Usage::eTransferDst, Memory::eDeviceLocal, {}};
    case BufferUse::upload:
      return {Usage::eStorageBuffer | Usage::eTransferSrc, host, Memory::eDeviceLocal};
    case BufferUse::readback:
      return {Usage::eStorageBuffer | Usage::eTransferDst, host, Memory::eHostCached};
    case BufferUse::structure:
      return {Usage::eAccelerationStructureStorageKHR, Memory::eDeviceLocal, {}};
    case BufferUse::instances:
      return {Usage::eAccelerationStructureBuildInputReadOnlyKHR, host, Memory::eDeviceLocal};
    case BufferUse::geometry:
      return {Usage::eStorageBuffer | Usage::eAccelerationStructureBuildInputReadOnlyKHR, Memory::eDeviceLocal, {}};
    case BufferUse::scratch:
      return {Usage::eStorageBuffer, Memory::eDeviceLocal, {}};
  }
  return {};
}

}  // namespace

Buffer::Buffer(Device& device, std::uint64_t bytes, BufferUse use)
    : device_(&device), bytes_(std::max<std::uint64_t>(bytes, 16)) {
  const UseFlags flags = flagsOf(use);
  try {
    buffer_ = device.handle().createBuffer(
        {.size = bytes_, .usage = flags.usage | vk::BufferUsageFlagBits::eShaderDeviceAddress});
    const auto needs = buffer_.getMemoryRequirements();
    const std::uint32_t type = device.memoryType(needs.memoryTypeBits, flags.required, flags.preferred);
    const vk::MemoryAllocateFlagsInfo addressable{.flags = vk::MemoryAllocateFlagBits::eDeviceAddress};
    memory_ =
        device.handle().allocateMemory({.pNext = &addressable, .allocationSize = needs.size, .memoryTypeIndex = type});
    buffer_.bindMemory(*memory_, 0);
    address_ = device.handle().getBufferAddress({.buffer = *buffer_});
    const auto mappable = vk::MemoryPropertyFlagBits::eHostVisible | vk::MemoryPropertyFlagBits::eHostCoherent;
    if ((device.memoryFlags(type) & mappable) == mappable) {
      mapped_ = static_cast<std::byte*>(memory_.mapMemory(0, VK_WHOLE_SIZE));
    }
  } catch (const vk::SystemError& error) {
    throw DeviceError(fmt::format("{}: no memory for {} bytes ({} in use, budget {}): {}", device.info().name, bytes_,
                                  device.info().memory_used_bytes, device.info().memory_budget_bytes, error.what()));
  }
  device.usedBytes() += bytes_;
}

Buffer& Buffer::operator=(Buffer&& other) noexcept {
  std::swap(device_, other.device_);
  std::swap(memory_, other.memory_);
  std::swap(buffer_, other.buffer_);
  std::swap(bytes_, other.bytes_);
  std::swap(address_, other.address_);
  std::swap(mapped_, other.mapped_);
  return *this;
}

Buffer::~Buffer() {
  if (device_ != nullptr) device_->usedBytes() -= bytes_;
}

void uploadBytes(Device& device, const Buffer& target, std::uint64_t offset, std::uint64_t bytes,
                 const std::function<void(std::uint64_t, std::span<std::byte>)>& fill) {
  if (bytes == 0) return;
  if (target.isMapped()) {
    fill(0, target.mapped().subspan(offset, bytes));
    return;
  }
  const Buffer staging(device, std::min(bytes, kStagingBytes), BufferUse::upload);
  for (std::uint64_t done = 0; done < bytes;) {
    const std::uint64_t piece = std::min(bytes - done, kStagingBytes);
    fill(done, staging.mapped().first(piece));
    device.submitAndWait([&](const vk::raii::CommandBuffer& commands) {
      commands.copyBuffer(staging.handle(), target.handle(), vk::BufferCopy{.dstOffset = offset + done, .size = piece});
    });
    done += piece;
  }
}

void uploadBytes(Device& device, const Buffer& target, std::span<const std::byte> bytes) {
  uploadBytes(device, target, 0, bytes.size(), [&](std::uint64_t offset, std::span<std::byte> piece) {
    std::memcpy(piece.data(), bytes.data() + offset, piece.size());
  });
}

}  // namespace blockwalk
