// SPDX-License-Identifier: Apache-2.0
// A device buffer with its memory, its address, and its mapping where the host can see it.
#pragma once

#include <span>
#include <vulkan/vulkan_raii.hpp>

#include "renderer/vulkan/device.h"

namespace blockwalk {

enum class BufferUse {
  resident,   // device memory, written once; mapped where device memory is host-visible
  upload,     // host memory, read by the device
  readback,   // host memory, cached, written by the device
  structure,  // acceleration structure storage
  instances,  // input of an acceleration structure build, host memory
  geometry,   // the same, written by a kernel
  scratch,    // acceleration structure scratch
};

// Move-only owner. Throws DeviceError with the needed bytes when memory is short.
class Buffer {
 public:
  Buffer() = default;
  Buffer(Device& device, std::uint64_t bytes, BufferUse use);
  Buffer(Buffer&& other) noexcept { *this = std::move(other); }
  Buffer& operator=(Buffer&& other) noexcept;
  ~Buffer();

  vk::Buffer handle() const { return *buffer_; }
  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t address() const { return address_; }
  bool isMapped() const { return mapped_ != nullptr; }
  // Only when isMapped().
  std::span<std::byte> mapped() const { return {mapped_, bytes_}; }
  template <typename T>
  std::span<T> mappedAs() const {
    return {reinterpret_cast<T*>(mapped_), bytes_ / sizeof(T)};
  }

 private:
  Device* device_ = nullptr;
  vk::raii::DeviceMemory memory_{nullptr};
  vk::raii::Buffer buffer_{nullptr};
  std::uint64_t bytes_ = 0;
  std::uint64_t address_ = 0;
  std::byte* mapped_ = nullptr;
};

// Copies host bytes into `target` at `offset`: by the mapping, or through a staging buffer of bounded size.
// `fill(offset, piece)` writes the bytes of [offset, offset + piece.size()) relative to the start of the copy.
void uploadBytes(Device& device, const Buffer& target, std::uint64_t offset, std::uint64_t bytes,
                 const std::function<void(std::uint64_t, std::span<std::byte>)>& fill);
void uploadBytes(Device& device, const Buffer& target, std::span<const std::byte> bytes);

// A resident buffer that holds `values`.
template <typename T>
Buffer uploadVector(Device& device, const std::vector<T>& values) {
  Buffer buffer(device, values.size() * sizeof(T), BufferUse::resident);
  uploadBytes(device, buffer, std::as_bytes(std::span(values)));
  return buffer;
}

}  // namespace blockwalk
