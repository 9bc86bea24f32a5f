// SPDX-License-Identifier: Apache-2.0
// Bytes on the device that kernels reach by their address alone: small ones share a buffer, which is an object of the
// driver's of a kilobyte and some microseconds to make, where a page of voxels may have no more than that.
#pragma once

#include <memory>
#include <span>

#include "renderer/vulkan/buffer.h"

namespace blockwalk {

// Move-only owner. Throws OutOfDeviceMemory as Buffer does. Of BufferUse::resident.
class Slice {
 public:
  Slice() = default;
  Slice(Device& device, std::uint64_t bytes);
  Slice(Slice&& other) noexcept { *this = std::move(other); }
  Slice& operator=(Slice&& other) noexcept;
  ~Slice();

  // That one of so many takes.
  static constexpr std::uint64_t bytesFor(std::uint64_t bytes) {
    return bytes <= Memory::kMostSmallBytes ? Memory::sliceBytes(bytes) : bytes;
  }
  std::uint64_t bytes() const { return own_ != nullptr ? own_->bytes() : piece_.bytes; }
  std::uint64_t address() const { return own_ != nullptr ? own_->address() : piece_.page->address + piece_.offset; }
  // From its first byte on.
  void upload(std::span<const std::byte> bytes);

 private:
  Device* device_ = nullptr;
  Memory::Piece piece_;
  std::unique_ptr<Buffer> own_;  // of a large one
};

}  // namespace blockwalk
