// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan/buffer.h"

#include <algorithm>
#include <cstring>

namespace blockwalk {
namespace {

constexpr std::uint64_t kStagingBytes = std::uint64_t{32} << 20;

}  // namespace

BufferFlags bufferFlags(BufferUse use) {
  using Usage = vk::BufferUsageFlagBits;
  using Property = vk::MemoryPropertyFlagBits;
  const auto host = Property::eHostVisible | Property::eHostCoherent;
  switch (use) {
    case BufferUse::resident:
      return {Usage::eStorageBuffer | Usage::eTransferDst | Usage::eTransferSrc, Property::eDeviceLocal, {}};
    case BufferUse::upload:
      return {Usage::eStorageBuffer | Usage::eTransferSrc, host, Property::eDeviceLocal};
    case BufferUse::readback:
      return {Usage::eStorageBuffer | Usage::eTransferDst, host, Property::eHostCached};
    case BufferUse::structure:
      return {Usage::eAccelerationStructureStorageKHR, Property::eDeviceLocal, {}};
    case BufferUse::instances:
      return {Usage::eAccelerationStructureBuildInputReadOnlyKHR, host, Property::eDeviceLocal};
    case BufferUse::geometry:
      return {Usage::eStorageBuffer | Usage::eAccelerationStructureBuildInputReadOnlyKHR, Property::eDeviceLocal, {}};
    case BufferUse::scratch:
      return {Usage::eStorageBuffer, Property::eDeviceLocal, {}};
  }
  return {};
}

void growTo(Device& device, Buffer& buffer, std::uint64_t bytes, BufferUse use) {
  if (buffer.bytes() >= bytes) return;
  buffer = {};  // first: both may not fit
  buffer = Buffer(device, bytes, use);
}

Buffer::Buffer(Device& device, std::uint64_t bytes, BufferUse use)
    : device_(&device), bytes_(std::max<std::uint64_t>(bytes, 16)) {
  device.makeRoom(bytes_ + Memory::kGranule);
  while (address_ == 0) {
    try {
      create(use);
    } catch (const OutOfDeviceMemory&) {
      release();
      // What others use no more gives way once the driver has none.
      if (!device.reclaim(bytes_)) throw;
    } catch (...) {
      release();
      throw;
    }
  }
}

void Buffer::create(BufferUse use) {
  const BufferFlags flags = bufferFlags(use);
  device_->calls().guard(DeviceCall::create, "a buffer", [&] {
    buffer_ = device_->handle().createBuffer(
        {.size = bytes_, .usage = flags.usage | vk::BufferUsageFlagBits::eShaderDeviceAddress});
    const auto needs = buffer_.getMemoryRequirements();
    piece_ =
        device_->memory().take(needs, device_->memoryType(needs.memoryTypeBits, flags.required, flags.preferred), use);
    buffer_.bindMemory(piece_.memory, piece_.offset);
    address_ = device_->handle().getBufferAddress({.buffer = *buffer_});
  });
}

Buffer& Buffer::operator=(Buffer&& other) noexcept {
  std::swap(device_, other.device_);
  std::swap(piece_, other.piece_);
  std::swap(buffer_, other.buffer_);
  std::swap(bytes_, other.bytes_);
  std::swap(address_, other.address_);
  return *this;
}

// The buffer before what it is bound to. Of a device that hangs both are left behind: a kernel may still write there.
void Buffer::release() noexcept {
  if (device_ != nullptr && device_->calls().hangs()) {
    [[maybe_unused]] const auto left = buffer_.release();
    [[maybe_unused]] const auto left_memory = piece_.own.release();
    piece_ = {};
    return;
  }
  buffer_ = nullptr;
  if (piece_.memory) device_->memory().give(piece_);
  piece_ = {};
}

Buffer::~Buffer() { release(); }

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

void writeWord(Device& device, const Buffer& target, std::uint64_t offset, std::uint64_t word) {
  if (target.isMapped()) {
    std::memcpy(target.mapped().data() + offset, &word, sizeof word);
    return;
  }
  device.submitAndWait([&](const vk::raii::CommandBuffer& commands) {
    commands.updateBuffer<std::uint64_t>(target.handle(), offset, word);
  });
}

void uploadBytes(Device& device, const Buffer& target, std::span<const std::byte> bytes) {
  uploadBytes(device, target, 0, bytes.size(), [&](std::uint64_t offset, std::span<std::byte> piece) {
    std::memcpy(piece.data(), bytes.data() + offset, piece.size());
  });
}

}  // namespace blockwalk
