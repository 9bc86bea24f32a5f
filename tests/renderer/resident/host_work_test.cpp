// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/host_work.h"

#include <gtest/gtest.h>

#include <future>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

namespace blockwalk {
namespace {

template <typename T>
T resultOf(HostWork<T>& work) {
  while (!work.isReady()) {
  }
  return work.take();
}

TEST(HostWork, IsDoneByAnotherThread) {
  HostWork<std::thread::id> work([] { return std::this_thread::get_id(); });
  EXPECT_NE(resultOf(work), std::this_thread::get_id());
}

TEST(HostWork, ThrowsWhatItsWorkThrew) {
  HostWork<int> work([]() -> int { throw std::runtime_error("told to fail"); });
  EXPECT_THROW(resultOf(work), std::runtime_error);
}

// Whoever waited may go at any time, and what is under way goes on for nobody.
TEST(HostWork, NobodyWaitsForItsEnd) {
  std::promise<void> may_end;
  const auto ended = std::make_shared<std::promise<void>>();
  {
    const HostWork<int> work([go = may_end.get_future().share(), ended] {
      go.wait();
      ended->set_value();
      return 0;
    });
  }
  may_end.set_value();
  ended->get_future().wait();
}

// Those that are too many begin once others have ended.
TEST(HostWork, OfManyAllAreDone) {
  std::vector<std::unique_ptr<HostWork<int>>> works;
  for (int i = 0; i < 3 * kMostHostWorks; ++i) {
    works.push_back(std::make_unique<HostWork<int>>([i] { return i; }));
  }
  for (int i = 0; i < 3 * kMostHostWorks; ++i) EXPECT_EQ(resultOf(*works[static_cast<std::size_t>(i)]), i);
}

}  // namespace
}  // namespace blockwalk
