// SPDX-License-Identifier: Apache-2.0
#include "tests/volume/allocations.h"

#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace blockwalk::volume_test {
namespace {

std::atomic<std::uint64_t> taken_count{0};
std::atomic<std::uint64_t> held_bytes{0};
std::atomic<std::uint64_t> most_bytes{0};

void* take(std::size_t bytes) noexcept {
  void* memory = std::malloc(std::max<std::size_t>(bytes, 1));
  if (memory == nullptr) return nullptr;
  ++taken_count;
  const std::uint64_t held = held_bytes += malloc_usable_size(memory);
  std::uint64_t most = most_bytes;
  while (most < held && !most_bytes.compare_exchange_weak(most, held)) {
  }
  return memory;
}

void give(void* memory) noexcept {
  held_bytes -= malloc_usable_size(memory);
  std::free(memory);
}

}  // namespace

Allocations allocations() { return {.count = taken_count, .bytes = held_bytes, .most = most_bytes}; }
void forgetMost() { most_bytes = held_bytes.load(); }

}  // namespace blockwalk::volume_test

// The other forms call these, or take and give by their own. A sanitizer has its own of each: what is taken by one of
// these is given by one of these.
void* operator new(std::size_t bytes) {
  if (void* memory = blockwalk::volume_test::take(bytes)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept { return blockwalk::volume_test::take(bytes); }
void operator delete(void* memory) noexcept { blockwalk::volume_test::give(memory); }
void operator delete(void* memory, std::size_t) noexcept { blockwalk::volume_test::give(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { blockwalk::volume_test::give(memory); }
