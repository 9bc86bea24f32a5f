// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan/memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <optional>

#include "volume/host_limits.h"

namespace blockwalk {
namespace {

// Left free: for the driver's own needs, and for other programs on a GPU. lavapipe and its compiler take some 60 MB
// while a kernel is made, and end the process where they get nothing.
constexpr std::uint64_t kReserve = std::uint64_t{64} << 20;
constexpr std::uint64_t kSoftwareReserve = std::uint64_t{128} << 20;
// So little is what the reserve is for: to look takes 0.1 ms.
constexpr std::uint64_t kFromReserve = std::uint64_t{8} << 20;

constexpr auto kMappable = vk::MemoryPropertyFlagBits::eHostVisible | vk::MemoryPropertyFlagBits::eHostCoherent;

std::uint64_t roundedUp(std::uint64_t value, std::uint64_t step) { return (value + step - 1) / step * step; }

}  // namespace

Memory::Memory(const vk::raii::PhysicalDevice& physical, const vk::raii::Device& device, DeviceCalls& calls,
               bool software, bool has_budget)
    : physical_(physical),
      device_(device),
      calls_(calls),
      software_(software),
      has_budget_(has_budget),
      properties_(physical.getMemoryProperties()) {
  for (std::uint32_t i = 0; i < properties_.memoryHeapCount; ++i) {
    const vk::MemoryHeap& heap = properties_.memoryHeaps[i];
    const bool local = static_cast<bool>(heap.flags & vk::MemoryHeapFlagBits::eDeviceLocal);
    if (local && heap.size > properties_.memoryHeaps[main_heap_].size) main_heap_ = i;
  }
}

std::uint64_t Memory::usedBytes() const { return std::accumulate(used_.begin(), used_.end(), host_); }

std::uint64_t Memory::lessReserve(std::uint64_t free) const {
  const std::uint64_t reserve = software_ ? kSoftwareReserve : kReserve;
  return free > reserve ? free - reserve : 0;
}

std::uint64_t Memory::freeBytes(std::uint32_t heap) const {
  if (software_) return lessReserve(std::min<std::uint64_t>(properties_.memoryHeaps[heap].size, freeHostBytes()));
  std::uint64_t most = properties_.memoryHeaps[heap].size;
  std::uint64_t used = heap_used_[heap];
  if (has_budget_) {
    const auto chain =
        physical_
            .getMemoryProperties2<vk::PhysicalDeviceMemoryProperties2, vk::PhysicalDeviceMemoryBudgetPropertiesEXT>();
    const auto& budget = chain.get<vk::PhysicalDeviceMemoryBudgetPropertiesEXT>();
    most = budget.heapBudget[heap];
    used = std::max<std::uint64_t>(used, budget.heapUsage[heap]);
  }
  return lessReserve(most > used ? most - used : 0);
}

void Memory::refuseMoreThan(std::uint64_t free, std::uint64_t bytes, const char* what) {
  if (bytes <= free) return;
  throw OutOfDeviceMemory(fmt::format("{}: {} bytes are needed, {} are free", what, bytes, free), bytes, free);
}

void Memory::requireOfHost(std::uint64_t bytes, const char* what) const {
  if (bytes <= kFromReserve) return;
  refuseMoreThan(lessReserve(freeHostBytes()), bytes, what);
}

Memory::Allocation Memory::allocate(std::uint64_t bytes, std::uint32_t type) {
  const std::uint32_t heap = properties_.memoryTypes[type].heapIndex;
  refuseMoreThan(freeBytes(heap), bytes, "device memory");
  const vk::MemoryAllocateFlagsInfo addressable{.flags = vk::MemoryAllocateFlagBits::eDeviceAddress};
  try {
    Allocation made;
    made.memory = device_.allocateMemory({.pNext = &addressable, .allocationSize = bytes, .memoryTypeIndex = type});
    if ((properties_.memoryTypes[type].propertyFlags & kMappable) == kMappable) {
      made.mapped = static_cast<std::byte*>(made.memory.mapMemory(0, VK_WHOLE_SIZE));
    }
    heap_used_[heap] += bytes;
    ++allocations_;
    return made;
  } catch (const vk::SystemError& error) {
    const auto result = static_cast<vk::Result>(error.code().value());
    if (result == vk::Result::eErrorDeviceLost) throw;
    const std::uint64_t free = freeBytes(heap);
    throw OutOfDeviceMemory(
        fmt::format("device memory: {} bytes are needed, {} are free: {}", bytes, free, vk::to_string(result)), bytes,
        free);
  }
}

void Memory::released(std::uint64_t bytes, std::uint32_t type) noexcept {
  heap_used_[properties_.memoryTypes[type].heapIndex] -= bytes;
  --allocations_;
}

Memory::Page& Memory::addPage(std::uint32_t type, std::uint64_t bytes) {
  auto page = std::make_unique<Page>();
  page->type = type;
  page->bytes = bytes;
  pages_.reserve(pages_.size() + 1);
  Allocation made = allocate(bytes, type);
  page->memory = std::move(made.memory);
  page->mapped = made.mapped;
  return *pages_.emplace_back(std::move(page));
}

Memory::Page& Memory::addPageOf(const PageKind& kind) {
  vk::raii::Buffer buffer =
      device_.createBuffer({.size = kPageBytes, .usage = kind.usage | vk::BufferUsageFlagBits::eShaderDeviceAddress});
  const vk::MemoryRequirements needs = buffer.getMemoryRequirements();
  Page& page = addPage(kind.type(needs.memoryTypeBits), needs.size);
  try {
    buffer.bindMemory(*page.memory, 0);
    page.address = device_.getBufferAddress({.buffer = *buffer});
    page.buffer = std::move(buffer);
  } catch (...) {
    released(page.bytes, page.type);
    pages_.pop_back();
    throw;
  }
  return page;
}

namespace {

// Free granules of a page in a row, or nothing.
std::optional<std::uint64_t> placeIn(Memory::Page& page, std::uint64_t granules, std::uint64_t alignment) {
  if (granules >= page.no_run_of) return std::nullopt;
  const std::uint64_t step = std::max<std::uint64_t>(1, alignment / Memory::kGranule);
  while (page.first_free < page.taken.size() && page.taken[page.first_free]) ++page.first_free;
  for (std::uint64_t at = roundedUp(page.first_free, step); at + granules <= page.taken.size();) {
    std::uint64_t free = 0;
    while (free < granules && !page.taken[at + free]) ++free;
    if (free == granules) return at;
    at = roundedUp(at + free + 1, step);
  }
  if (step == 1) page.no_run_of = granules;
  return std::nullopt;
}

}  // namespace

// Sets all of a small piece but its use and bytes.
template <typename IsOfKind, typename Add>
void Memory::placeInPage(Piece& piece, std::uint64_t alignment, IsOfKind is_of_kind, Add add) {
  const std::uint64_t granules = piece.bytes / kGranule;
  std::optional<std::uint64_t> place;
  const auto placeInside = [&](Page& page) {
    if (is_of_kind(page)) place = placeIn(page, granules, alignment);
    piece.page = &page;
    return place.has_value();
  };
  if (likely_ == nullptr || !placeInside(*likely_)) {
    for (const std::unique_ptr<Page>& page : pages_) {
      if (placeInside(*page)) break;
    }
  }
  if (!place) {
    piece.page = &add();
    place = 0;
  }
  for (std::uint64_t i = 0; i < granules; ++i) piece.page->taken.set(*place + i);
  likely_ = piece.page;
  piece.type = piece.page->type;
  piece.memory = *piece.page->memory;
  piece.offset = *place * kGranule;
  piece.mapped = piece.page->mapped != nullptr ? piece.page->mapped + piece.offset : nullptr;
}

Memory::Piece Memory::takeSlice(std::uint64_t bytes, BufferUse use, const PageKind& kind) {
  return calls_.guard(DeviceCall::allocate, "device memory", [&] {
    Piece piece;
    piece.use = use;
    piece.bytes = sliceBytes(bytes);
    placeInPage(
        piece, kGranule, [](const Page& page) { return page.address != 0; },
        [&]() -> Page& { return addPageOf(kind); });
    used_[static_cast<std::size_t>(use)] += piece.bytes;
    return piece;
  });
}

Memory::Piece Memory::take(const vk::MemoryRequirements& needs, std::uint32_t type, BufferUse use) {
  return calls_.guard(DeviceCall::allocate, "device memory", [&] {
    Piece piece;
    piece.use = use;
    piece.type = type;
    if (needs.size > kMostSmallBytes || needs.alignment > kMostSmallBytes) {
      piece.bytes = needs.size;
      Allocation made = allocate(piece.bytes, type);
      piece.own = std::move(made.memory);
      piece.memory = *piece.own;
      piece.mapped = made.mapped;
    } else {
      piece.bytes = roundedUp(needs.size, kGranule);
      placeInPage(
          piece, needs.alignment, [type](const Page& page) { return page.type == type && page.address == 0; },
          [&]() -> Page& { return addPage(type, kPageBytes); });
    }
    used_[static_cast<std::size_t>(use)] += piece.bytes;
    return piece;
  });
}

void Memory::give(Piece& piece) noexcept {
  used_[static_cast<std::size_t>(piece.use)] -= piece.bytes;
  if (piece.page == nullptr) {
    released(piece.bytes, piece.type);
    piece.own = nullptr;
    return;
  }
  const std::uint64_t first = piece.offset / kGranule;
  for (std::uint64_t i = 0; i < piece.bytes / kGranule; ++i) piece.page->taken.reset(first + i);
  piece.page->first_free = std::min(piece.page->first_free, first);
  piece.page->no_run_of = kPageBytes / kGranule + 1;
  likely_ = piece.page;
  if (piece.page->taken.any()) return;
  likely_ = nullptr;
  const std::uint64_t bytes = piece.page->bytes;
  std::erase_if(pages_, [&](const std::unique_ptr<Page>& page) { return page.get() == piece.page; });
  released(bytes, piece.type);
}

}  // namespace blockwalk
