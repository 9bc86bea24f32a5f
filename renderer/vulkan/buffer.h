// SPDX-License-Identifier: Apache-2.0
// A device buffer with its memory, its address, and its mapping where the host can see it.
#pragma once

#include <span>
#include <vulkan/vulkan_raii.hpp>

#include "renderer/vulkan/device.h"

namespace blockwalk {

// What buffers for something are made with.
struct BufferFlags {
  vk::BufferUsageFlags usage;
  vk::MemoryPropertyFlags required;
  vk::MemoryPropertyFlags preferred;
};
BufferFlags bufferFlags(BufferUse use);

// Move-only owner. Throws OutOfDeviceMemory with the needed and free bytes when memory is short.
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
  bool isMapped() const { return piece_.mapped != nullptr; }
  // Only when isMapped().
  std::span<std::byte> mapped() const { return {piece_.mapped, bytes_}; }
  template <typename T>
  std::span<T> mappedAs() const {
    return {reinterpret_cast<T*>(piece_.mapped), bytes_ / sizeof(T)};
  }

 private:
  void create(BufferUse use);
  void release() noexcept;

  Device* device_ = nullptr;
  Memory::Piece piece_;
  vk::raii::Buffer buffer_{nullptr};
  std::uint64_t bytes_ = 0;
  std::uint64_t address_ = 0;
};

// Copies host bytes into `target` at `offset`: by the mapping, or through a staging buffer of bounded size.
// `fill(offset, piece)` writes the bytes of [offset, offset + piece.size()) relative to the start of the copy.
void uploadBytes(Device& device, const Buffer& target, std::uint64_t offset, std::uint64_t bytes,
                 const std::function<void(std::uint64_t, std::span<std::byte>)>& fill);
void uploadBytes(Device& device, const Buffer& target, std::span<const std::byte> bytes);

// Makes the buffer anew where it has fewer bytes.
void growTo(Device& device, Buffer& buffer, std::uint64_t bytes, BufferUse use);

// A resident buffer that holds `values`.
template <typename T>
Buffer uploadVector(Device& device, const std::vector<T>& values) {
  Buffer buffer(device, values.size() * sizeof(T), BufferUse::resident);
  uploadBytes(device, buffer, std::as_bytes(std::span(values)));
  return buffer;
}

// Eight bytes, at a multiple of four. Takes no memory.
void writeWord(Device& device, const Buffer& target, std::uint64_t offset, std::uint64_t word);

}  // namespace blockwalk
