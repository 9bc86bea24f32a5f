// SPDX-License-Identifier: Apache-2.0
#include "volume/build/spill.h"

#include <sys/mman.h>

#include <algorithm>
#include <cstring>

namespace blockwalk {

namespace {

// All pages at once instead of one after the other as they are written. A kernel that cannot does so then.
void takePages(std::span<std::byte> bytes) {
#ifdef MADV_POPULATE_WRITE
  constexpr std::uintptr_t kPage = 4096;
  // The memory that it is a part of begins at a page.
  const std::uintptr_t before = reinterpret_cast<std::uintptr_t>(bytes.data()) % kPage;
  if (!bytes.empty()) ::madvise(bytes.data() - before, bytes.size() + before, MADV_POPULATE_WRITE);
#endif
}

}  // namespace

Spill::Spill(const std::filesystem::path& folder, std::size_t slot_bytes, std::uint64_t memory_bytes,
             std::size_t stream_bytes)
    : slot_bytes_(slot_bytes), file_(folder, stream_bytes) {
  const auto bytes = static_cast<std::size_t>(memory_bytes / slot_bytes * slot_bytes);
  if (bytes == 0) return;
  // Addresses only: a page is taken when it is first written. No huge ones: a virtual machine that gives free memory
  // back to its host has given back just those, and gets them again slower than a disk is written.
  void* memory = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (memory == MAP_FAILED) return;
  ::madvise(memory, bytes, MADV_NOHUGEPAGE);  // fails where the kernel has none
  memory_ = {static_cast<std::byte*>(memory), bytes};
}

Spill::~Spill() {
  if (!memory_.empty()) ::munmap(memory_.data(), memory_.size());
}

std::uint64_t Spill::append(std::span<const std::byte> slots, std::span<const std::size_t> order) {
  const auto slotAt = [&](std::size_t index) { return slots.subspan(index * slot_bytes_, slot_bytes_); };
  const std::uint64_t capacity = memory_.size() / slot_bytes_;
  std::uint64_t first = 0;
  std::size_t fitting = 0;
  {
    const std::lock_guard lock(mutex_);
    first = slots_;
    fitting = static_cast<std::size_t>(std::min<std::uint64_t>(order.size(), capacity - std::min(first, capacity)));
    for (const std::size_t index : order.subspan(fitting)) file_.append(slotAt(index));
    slots_ += order.size();
  }
  if (fitting > 0) {
    const std::span<std::byte> to = memory_.subspan(first * slot_bytes_, fitting * slot_bytes_);
    takePages(to);
    for (std::size_t i = 0; i < fitting; ++i) {
      std::memcpy(to.data() + i * slot_bytes_, slotAt(order[i]).data(), slot_bytes_);
    }
  }
  return first;
}

std::span<const std::byte> Spill::inMemory(std::uint64_t slot, std::uint64_t count) const {
  if ((slot + count) * slot_bytes_ > memory_.size()) return {};
  return memory_.subspan(slot * slot_bytes_, count * slot_bytes_);
}

void Spill::read(std::uint64_t offset, std::span<std::byte> out) const {
  if (offset < memory_.size()) {
    const std::span<const std::byte> from = memory_.subspan(offset, std::min(out.size(), memory_.size() - offset));
    std::memcpy(out.data(), from.data(), from.size());
    out = out.subspan(from.size());
    offset += from.size();
  }
  if (!out.empty()) file_.read(offset - memory_.size(), out);
}

}  // namespace blockwalk
