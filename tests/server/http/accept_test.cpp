// SPDX-License-Identifier: Apache-2.0
// Memory that runs out while connections are accepted: a connection may be lost, the server may not be deaf.
#include <gtest/gtest.h>
#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "tests/server/running_server.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kCanFail = false;  // the sanitizer owns the allocator
#else
constexpr bool kCanFail = true;

namespace {

std::atomic<int> allocations_left{-1};  // of threads that are not exempt, until one fails; negative: none does
thread_local bool is_exempt = false;

bool failsNow() {
  if (is_exempt || allocations_left.load(std::memory_order_relaxed) < 0) return false;
  return allocations_left.fetch_sub(1) == 0;
}

}  // namespace

// Replaced for the whole test program, as the language allows.
void* operator new(std::size_t size) {
  void* memory = failsNow() ? nullptr : std::malloc(size == 0 ? 1 : size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
// Asio's coroutine frames and handlers come from here.
extern "C" void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return failsNow() ? nullptr : memalign(alignment, size);
}
#endif

namespace blockwalk {
namespace {

TEST(Accept, GoesOnWhenMemoryRunsOut) {
  if (!kCanFail) GTEST_SKIP() << "needs an allocator of its own";
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  RunningServer server;
  is_exempt = true;
  int failed = 0;
  // The first allocations of a connection, accepting itself among them. Some of the later ones end the process.
  for (int n = 0; n < 12; ++n) {
    {
      // Several at once, so that accepting needs new memory and not what the last connection gave back.
      std::vector<WireClient> clients;
      allocations_left = n;
      for (int i = 0; i < 4; ++i) {
        clients.emplace_back(server.port());
        clients.back().send("GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n");
      }
      for (WireClient& client : clients) client.readReply();
      if (allocations_left.exchange(-1) < 0) ++failed;
    }
    ASSERT_EQ(get(server.port(), "/healthz").status, 200) << "deaf after allocation " << n << " failed";
  }
  is_exempt = false;
  EXPECT_EQ(failed, 12) << "memory never ran out";
#endif
}

}  // namespace
}  // namespace blockwalk
