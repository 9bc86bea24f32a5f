// SPDX-License-Identifier: Apache-2.0
#include "server/render/fair_queue.h"

#include <gtest/gtest.h>

#include <array>

namespace blockwalk {
namespace {

TEST(FairQueue, KeepsTheOrderOfOneClient) {
  FairQueue<int> queue;
  for (int i = 0; i < 5; ++i) queue.add(1, i);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(queue.take()->second, i);
  EXPECT_FALSE(queue.take().has_value());
}

TEST(FairQueue, SharesByDeviceTimeAndNotByCount) {
  FairQueue<int> queue;
  std::array<double, 3> used{};
  const std::array<double, 3> cost{1, 10, 40};
  for (std::uint64_t client = 0; client < 3; ++client) queue.add(client, 0);
  for (int i = 0; i < 2000; ++i) {
    const auto taken = queue.take();
    used[taken->first] += cost[taken->first];
    queue.charge(taken->first, cost[taken->first]);
    queue.add(taken->first, 0);
  }
  EXPECT_NEAR(used[0], used[2], 80);
  EXPECT_NEAR(used[1], used[2], 80);
}

TEST(FairQueue, SilenceEarnsNoCredit) {
  FairQueue<int> queue;
  for (int i = 0; i < 100; ++i) {
    queue.add(1, 0);
    queue.take();
    queue.charge(1, 10);
  }
  queue.add(1, 0);
  queue.add(1, 0);
  for (int i = 0; i < 100; ++i) queue.add(2, 0);
  int taken_before_first = 0;
  while (queue.take()->first != 1) {
    queue.charge(2, 10);
    ++taken_before_first;
  }
  EXPECT_LE(taken_before_first, 2);
}

TEST(FairQueue, ManyClientsOfOneJobEachAreForgotten) {
  FairQueue<int> queue;
  for (std::uint64_t client = 1; client <= 20000; ++client) {
    queue.add(client, 0);
    ASSERT_TRUE(queue.take());
    queue.charge(client, 2);
  }
  EXPECT_LE(queue.accounts(), 2000u);
}

}  // namespace
}  // namespace blockwalk
