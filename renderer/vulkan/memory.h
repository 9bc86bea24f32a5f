// SPDX-License-Identifier: Apache-2.0
// Device memory: sized before it is taken, counted by purpose, small pieces out of shared allocations.
//
// An allocation is refused where it would leave less than the reserve of what is free: on hardware what the driver says
// (VK_EXT_memory_budget, else the heap), on a software device what the process may still take of the host, whose driver
// does not survive a failure of its own. Devices allow as few as 4096 allocations; pieces up to kMostSmallBytes share
// pages of kPageBytes, each of one memory type. Slices (renderer/vulkan/slice.h) share pages that are one buffer each.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>
#include <vulkan/vulkan_raii.hpp>

#include "renderer/vulkan/device_calls.h"

namespace blockwalk {

// What a buffer is for.
enum class BufferUse : std::uint8_t {
  resident,   // device memory, written once; mapped where device memory is host-visible
  upload,     // host memory, read by the device
  readback,   // host memory, cached, written by the device
  structure,  // acceleration structure storage
  instances,  // input of an acceleration structure build, host memory
  geometry,   // the same, written by a kernel
  scratch,    // acceleration structure scratch
};
constexpr std::size_t kBufferUses = 7;

class Memory {
 public:
  // All outlive it. `has_budget`: VK_EXT_memory_budget is there.
  Memory(const vk::raii::PhysicalDevice& physical, const vk::raii::Device& device, DeviceCalls& calls, bool software,
         bool has_budget);
  Memory(const Memory&) = delete;
  Memory& operator=(const Memory&) = delete;

  static constexpr std::uint64_t kPageBytes = std::uint64_t{4} << 20;
  static constexpr std::uint64_t kMostSmallBytes = std::uint64_t{256} << 10;
  static constexpr std::uint64_t kGranule = 256;

  struct Page {
    vk::raii::DeviceMemory memory{nullptr};
    std::byte* mapped = nullptr;
    std::uint32_t type = 0;
    std::uint64_t bytes = kPageBytes;  // of the allocation
    std::bitset<kPageBytes / kGranule> taken;
    std::uint64_t first_free = 0;                         // all granules below are taken
    std::uint64_t no_run_of = kPageBytes / kGranule + 1;  // so many free in a row there are not
    vk::raii::Buffer buffer{nullptr};                     // of slices: all of it
    std::uint64_t address = 0;                            // its
  };
  struct Piece {
    vk::DeviceMemory memory;
    std::uint64_t offset = 0;
    std::uint64_t bytes = 0;  // that it takes
    std::byte* mapped = nullptr;
    BufferUse use = BufferUse::resident;
    std::uint32_t type = 0;
    Page* page = nullptr;                 // of a small one
    vk::raii::DeviceMemory own{nullptr};  // of a large one
  };
  // Throws OutOfDeviceMemory with the needed and free bytes.
  Piece take(const vk::MemoryRequirements& needs, std::uint32_t type, BufferUse use);
  // At most kMostSmallBytes of a page that is one buffer, at a multiple of kGranule.
  struct PageKind {
    vk::BufferUsageFlags usage;
    std::function<std::uint32_t(std::uint32_t type_bits)> type;
  };
  Piece takeSlice(std::uint64_t bytes, BufferUse use, const PageKind& kind);
  static constexpr std::uint64_t sliceBytes(std::uint64_t bytes) {
    return (bytes + kGranule - 1) / kGranule * kGranule;
  }
  void give(Piece& piece) noexcept;

  // Throws OutOfDeviceMemory where the host has not so many bytes and the reserve, for what is about to take them
  // there: pixels, a compiler's work. A few MB pass always. Any thread.
  void requireOfHost(std::uint64_t bytes, const char* what) const;
  // That could be taken of the largest device-local heap, less the reserve.
  std::uint64_t freeBytes() const { return freeBytes(main_heap_); }
  std::uint64_t usedBytes() const;  // by pieces, and of the host
  // What the host keeps for the sake of volumes (renderer/vulkan/host_share.h).
  void hostTakes(std::uint64_t bytes) { host_ += bytes; }
  void hostGives(std::uint64_t bytes) noexcept { host_ -= bytes; }
  std::uint64_t usedBytes(BufferUse use) const { return used_[static_cast<std::size_t>(use)]; }
  std::size_t allocations() const { return allocations_; }

 private:
  std::uint64_t freeBytes(std::uint32_t heap) const;
  std::uint64_t lessReserve(std::uint64_t free) const;
  static void refuseMoreThan(std::uint64_t free, std::uint64_t bytes, const char* what);
  struct Allocation {
    vk::raii::DeviceMemory memory{nullptr};
    std::byte* mapped = nullptr;
  };
  Allocation allocate(std::uint64_t bytes, std::uint32_t type);
  void released(std::uint64_t bytes, std::uint32_t type) noexcept;
  Page& addPage(std::uint32_t type, std::uint64_t bytes);
  Page& addPageOf(const PageKind& kind);
  template <typename IsOfKind, typename Add>
  void placeInPage(Piece& piece, std::uint64_t alignment, IsOfKind is_of_kind, Add add);

  const vk::raii::PhysicalDevice& physical_;
  const vk::raii::Device& device_;
  DeviceCalls& calls_;
  bool software_;
  bool has_budget_;
  vk::PhysicalDeviceMemoryProperties properties_;
  std::uint32_t main_heap_ = 0;
  std::array<std::uint64_t, VK_MAX_MEMORY_HEAPS> heap_used_{};  // allocated, pages whole
  std::array<std::uint64_t, kBufferUses> used_{};
  std::uint64_t host_ = 0;
  std::size_t allocations_ = 0;
  std::vector<std::unique_ptr<Page>> pages_;
  Page* likely_ = nullptr;  // of those: where something was taken or given back last
};

}  // namespace blockwalk
