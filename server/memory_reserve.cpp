// SPDX-License-Identifier: Apache-2.0
// operator new with a reserve. What ends a coroutine, destroys a document or writes a refusal takes a little memory
// where it must not fail: Asio posts from a destructor, nlohmann's destructor of an array keeps a stack. When malloc
// refuses, such a little comes from here, so that one request fails and not the process; what is larger than a block,
// or when all are taken, is std::bad_alloc as ever. Sanitizers bring an operator new of their own, and keep it.
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <new>

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

namespace {

constexpr std::size_t kAlignment = alignof(std::max_align_t);

// Blocks of one size, the free ones in a list. Zero until used: takes no memory before.
template <std::size_t kBlockBytes, std::size_t kBlocks>
class Reserve {
 public:
  void* take(std::size_t bytes) noexcept {
    if (bytes > kBlockBytes) return nullptr;
    lock();
    void* block = nullptr;
    if (free_ != nullptr) {
      block = free_;
      free_ = *static_cast<void**>(block);
    } else if (used_ < kBlocks) {
      block = memory_.data() + kBlockBytes * used_++;
    }
    unlock();
    return block;
  }

  bool give(void* block) noexcept {
    const auto address = reinterpret_cast<std::uintptr_t>(block);
    const auto begin = reinterpret_cast<std::uintptr_t>(memory_.data());
    if (address < begin || address >= begin + memory_.size()) return false;
    lock();
    *static_cast<void**>(block) = free_;
    free_ = block;
    unlock();
    return true;
  }

 private:
  void lock() noexcept {
    while (busy_.test_and_set(std::memory_order_acquire)) {
    }
  }
  void unlock() noexcept { busy_.clear(std::memory_order_release); }

  alignas(kAlignment) std::array<std::byte, kBlockBytes * kBlocks> memory_{};
  std::atomic_flag busy_ = ATOMIC_FLAG_INIT;
  void* free_ = nullptr;
  std::size_t used_ = 0;  // blocks that were ever taken
};

constinit Reserve<1024, 2048> small_blocks;
constinit Reserve<65536, 32> large_blocks;

}  // namespace

void* operator new(std::size_t bytes) {
  void* memory = std::malloc(bytes == 0 ? 1 : bytes);
  if (memory == nullptr) memory = small_blocks.take(bytes);
  if (memory == nullptr) memory = large_blocks.take(bytes);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

void operator delete(void* memory) noexcept {
  if (!small_blocks.give(memory) && !large_blocks.give(memory)) std::free(memory);
}

void operator delete(void* memory, std::size_t) noexcept { operator delete(memory); }

#endif
