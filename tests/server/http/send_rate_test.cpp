// SPDX-License-Identifier: Apache-2.0
// How slowly a client may take what it is sent.
#include <gtest/gtest.h>

#include "server/http/send_watch.h"
#include "tests/server/running_server.h"

namespace blockwalk {
namespace {

using std::chrono::seconds;
using Clock = SendRate::Clock;

constexpr SendBounds kBounds{.patience = seconds(20), .bytes_per_second = 24 << 10};

// When a client is cut off that takes `rate` bytes a second; in whole seconds, at most an hour.
int cutAfter(double rate, int asked_every = 1) {
  const Clock::time_point begin{};
  SendRate judge(kBounds, begin);
  for (int second = 0; second < 3600; second += asked_every) {
    if (judge.isTooSlow(static_cast<std::uint64_t>(rate * second), begin + seconds(second))) return second;
  }
  return 3600;
}

TEST(SendRate, AnHonestSlowReaderIsNeverCutOff) { EXPECT_EQ(cutAfter(40000), 3600); }

TEST(SendRate, WhoHoldsTheReplyIsCutOffSoon) {
  EXPECT_LE(cutAfter(14000), 50);
  EXPECT_LE(cutAfter(100), 22);
  EXPECT_EQ(cutAfter(0), 21);
}

TEST(SendRate, WhatLeavesInJumpsIsJudgedOverTheWhole) {
  const Clock::time_point begin{};
  SendRate judge(kBounds, begin);
  for (int second = 0; second < 600; ++second) {
    const std::uint64_t left = static_cast<std::uint64_t>(second / 15) * 600000;  // 40 kB/s, every 15 s
    ASSERT_FALSE(judge.isTooSlow(left, begin + seconds(second))) << second;
  }
}

TEST(SendRate, WhoStopsIsCutOffHoweverFastItWas) {
  const Clock::time_point begin{};
  SendRate judge(kBounds, begin);
  EXPECT_FALSE(judge.isTooSlow(std::uint64_t{1} << 30, begin + seconds(1)));
  EXPECT_FALSE(judge.isTooSlow(std::uint64_t{1} << 30, begin + seconds(20)));
  EXPECT_TRUE(judge.isTooSlow(std::uint64_t{1} << 30, begin + seconds(22)));
}

// A reply of 64 MiB of which the client takes nothing: the connection is closed, and what it held is free again.
TEST(SendRate, AReplyThatIsNotTakenIsLetGo) {
  ServerOptions options;
  options.send_time = 1;
  RunningServer server(options);
  WireClient client(server.port());
  client.send("GET /api/v1/volumes/rock/image?size=4096x4096&format=raw HTTP/1.1\r\nHost: localhost\r\n\r\n");
  const auto held = [&] {
    return get(server.port(), "/metrics").body.find("blockwalk_image_jobs 0\n") == std::string::npos;
  };
  EXPECT_TRUE(eventually(held));
  EXPECT_TRUE(eventually([&] { return !held(); }));
}

}  // namespace
}  // namespace blockwalk
