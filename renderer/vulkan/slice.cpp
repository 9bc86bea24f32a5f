// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan/slice.h"

#include <cstring>
#include <utility>

namespace blockwalk {

Slice::Slice(Device& device, std::uint64_t bytes) : device_(&device) {
  if (bytes > Memory::kMostSmallBytes) {
    own_ = std::make_unique<Buffer>(device, bytes, BufferUse::resident);
    return;
  }
  const BufferFlags flags = bufferFlags(BufferUse::resident);
  const Memory::PageKind kind{.usage = flags.usage, .type = [&](std::uint32_t type_bits) {
                                return device.memoryType(type_bits, flags.required, flags.preferred);
                              }};
  device.makeRoom(Memory::sliceBytes(bytes));
  while (piece_.page == nullptr) {
    try {
      piece_ = device.memory().takeSlice(bytes, BufferUse::resident, kind);
    } catch (const OutOfDeviceMemory&) {
      // What others use no more gives way once the driver has none.
      if (!device.reclaim(Memory::kPageBytes)) throw;
    }
  }
}

Slice& Slice::operator=(Slice&& other) noexcept {
  std::swap(device_, other.device_);
  std::swap(piece_, other.piece_);
  std::swap(own_, other.own_);
  return *this;
}

// Of a device that hangs it is left behind: a kernel may still write there.
Slice::~Slice() {
  if (piece_.page != nullptr && !device_->calls().hangs()) device_->memory().give(piece_);
}

void Slice::upload(std::span<const std::byte> bytes) {
  if (own_ != nullptr) return uploadBytes(*device_, *own_, bytes);
  if (piece_.mapped != nullptr) {
    std::memcpy(piece_.mapped, bytes.data(), bytes.size());
    return;
  }
  const Buffer staging(*device_, bytes.size(), BufferUse::upload);
  std::memcpy(staging.mapped().data(), bytes.data(), bytes.size());
  device_->submitAndWait([&](const vk::raii::CommandBuffer& commands) {
    commands.copyBuffer(staging.handle(), *piece_.page->buffer,
                        vk::BufferCopy{.dstOffset = piece_.offset, .size = bytes.size()});
  });
}

}  // namespace blockwalk
