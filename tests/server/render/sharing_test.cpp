// SPDX-License-Identifier: Apache-2.0
// One honest viewer beside those who ask for as much as they can get: over loopback, so that all are one peer, on a
// device that takes its time. How many frames that makes on a machine without noise is fair_queue_test.cpp's.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/server/running_server.h"
#include "tests/server/stream/view_message.h"

namespace blockwalk {
namespace {

using Clock = std::chrono::steady_clock;
constexpr const char* kRockPath = "/api/v1/volumes/rock/image";

class Sharing : public testing::Test {
 protected:
  Sharing() {
    server_.control().bands = 8;
    server_.control().band_ms = 25;
    server_.control().band_pixels = 1 << 14;  // 2048x2048 takes 6.4 s
  }
  ~Sharing() override {
    over_ = true;
    for (std::thread& loop : loops_) loop.join();
  }

  // Each view is sent when the frame of the one before came. The longest time between two, in seconds.
  double watch(double watched_s) {
    StreamClient client(server_.port(), "rock");
    const auto elapsed = [](Clock::time_point from) {
      return std::chrono::duration<double>(Clock::now() - from).count();
    };
    const auto begin = Clock::now();
    auto last = begin;
    double longest_gap = 0;
    for (int id = 1; elapsed(begin) < watched_s; ++id) {
      client.sendText(viewMessage(id, fmt::format(R"("size":[64,48],"fov":{})", 20 + id % 50)));
      client.readFrame();
      longest_gap = std::max(longest_gap, elapsed(last));
      last = Clock::now();
    }
    return longest_gap;
  }

  void loop(const std::string& size, bool keep_alive, const std::string& format = "raw") {
    loops_.emplace_back([this, size, keep_alive, format, number = loops_.size()] {
      std::optional<WireClient> client;
      for (int i = 0; !over_; ++i) {
        if (!client || !keep_alive) client.emplace(server_.port());
        client->send(fmt::format("GET {}?size={}&format={}&fov={} HTTP/1.1\r\nHost: localhost\r\n\r\n", kRockPath, size,
                                 format, 20 + (i + static_cast<int>(number)) % 50));
        while (!over_ && !client->hasBytes()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
        if (over_) return;
        if (client->readReply().status == 200) continue;
        client.reset();
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      }
    });
  }
  // Half of the device: all requests of a peer are one share beside a stream, whose frame takes 0.2 s alone.
  void expectItsShare() {
    FakeControl& control = server_.control();
    ASSERT_TRUE(eventually([&] { return control.started > 0; }));
    const std::int64_t busy = control.busy_us;
    const std::int64_t own = control.small_busy_us;
    EXPECT_LT(watch(5), 1) << "a frame takes 0.4 s";
    EXPECT_GE(static_cast<double>(control.small_busy_us - own),
              0.9 * 0.5 * static_cast<double>(control.busy_us - busy));
  }

  std::atomic<bool> over_ = false;
  RunningServer server_;
  std::vector<std::thread> loops_;
};

TEST_F(Sharing, BesideOneHogOnOneConnection) {
  loop("2048x2048", true);
  expectItsShare();
}

TEST_F(Sharing, BesideTwoEndlessLoopsOfSmallPictures) {
  for (int i = 0; i < 2; ++i) loop("128x128", false);
  expectItsShare();
}

TEST_F(Sharing, BesideFourLoopsOfLargePicturesWithNewConnections) {
  for (int i = 0; i < 4; ++i) loop("2048x2048", false);
  expectItsShare();
}

TEST_F(Sharing, BesideThirtyTwoLoops) {
  for (int i = 0; i < 32; ++i) loop("512x512", false);
  expectItsShare();
}

TEST_F(Sharing, BesideSixtyFourAtOnce) {
  for (int i = 0; i < 64; ++i) loop("2048x2048", true);
  expectItsShare();
  EXPECT_LE(server_.control().most_under_way, RenderThread::kRequestsUnderWay + 1);
}

// Two of them would have both threads, for a second and more each.
TEST_F(Sharing, BesideLargePicturesThatTakeLongToEncode) {
  server_.control().bands = 1;
  server_.control().band_ms = 1;
  server_.control().band_pixels = 0;
  for (int i = 0; i < 6; ++i) loop("2048x2048", true, "webp&quality=100");
  ASSERT_TRUE(eventually([&] { return server_.control().finished >= 4; }));
  EXPECT_LT(watch(5), 0.6);
}

std::string metricLine(std::uint16_t port, const std::string& name) {
  const std::string text = get(port, "/metrics").body;
  const std::size_t at = text.find("\nblockwalk_" + name + " ");
  return at == std::string::npos ? "" : text.substr(at + 1, text.find('\n', at + 1) - at - 1);
}

// Nobody is there to be refused.
void expectNoFailureSince(std::uint16_t port, const std::string& failed_before) {
  EXPECT_TRUE(eventually([&] { return metricLine(port, "image_jobs") == "blockwalk_image_jobs 0"; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(metricLine(port, "failed_requests_total"), failed_before);
}

TEST(Departure, APictureThatNobodyWaitsForIsGivenUp) {
  RunningServer server;
  const std::string failed = metricLine(server.port(), "failed_requests_total");
  server.control().bands = 1000;
  server.control().band_ms = 10;
  {
    WireClient client(server.port());
    client.send(fmt::format("GET {}?size=64x64 HTTP/1.1\r\nHost: localhost\r\n\r\n", kRockPath));
    EXPECT_TRUE(eventually([&] { return server.control().started > 0; }));
    std::this_thread::sleep_for(std::chrono::milliseconds(120));
  }
  EXPECT_TRUE(eventually([&] { return server.control().cancelled == 1; }));
  EXPECT_EQ(get(server.port(), "/healthz").status, 200);
  expectNoFailureSince(server.port(), failed);
}

TEST(Departure, WhoClosedRightAfterAskingHasLeftToo) {
  RunningServer server;
  const std::string failed = metricLine(server.port(), "failed_requests_total");
  server.control().bands = 1000;
  server.control().band_ms = 10;
  WireClient(server.port()).send(fmt::format("GET {}?size=64x64 HTTP/1.1\r\nHost: localhost\r\n\r\n", kRockPath));
  EXPECT_TRUE(eventually([&] { return server.control().cancelled == 1; }));
  EXPECT_EQ(get(server.port(), "/healthz").status, 200);
  expectNoFailureSince(server.port(), failed);
}

TEST(Departure, WhoOnlyEndedItsSendingGetsTheReply) {
  RunningServer server;
  server.control().bands = 30;
  server.control().band_ms = 10;
  WireClient client(server.port());
  client.send(fmt::format("GET {}?size=64x64 HTTP/1.1\r\nHost: localhost\r\n\r\n", kRockPath));
  client.finishSending();
  EXPECT_EQ(client.readReply(false).status, 102);
  EXPECT_EQ(client.readReply().status, 200);
}

// Those that are drawn leave last, so that no place comes free for one whose leaving is not read yet.
TEST(Departure, ManyThatLeftDoNotHoldUpTheRest) {
  RunningServer server;
  server.control().bands = 1000;
  server.control().band_ms = 10;
  const auto ask = [&](std::vector<WireClient>& clients, int count) {
    for (int i = 0; i < count; ++i) {
      clients.emplace_back(server.port());
      clients.back().send(
          fmt::format("GET {}?size=64x64&fov={} HTTP/1.1\r\nHost: localhost\r\n\r\n", kRockPath, 20 + i));
    }
  };
  const auto jobsBecome = [&](int count) {
    const std::string line = fmt::format("blockwalk_image_jobs {}\n", count);
    return eventually([&] { return get(server.port(), "/metrics").body.find(line) != std::string::npos; });
  };
  std::vector<WireClient> drawn;
  ask(drawn, RenderThread::kRequestsUnderWay);
  ASSERT_TRUE(eventually([&] { return server.control().started == RenderThread::kRequestsUnderWay; }));
  std::vector<WireClient> waiting;
  ask(waiting, 16);
  EXPECT_TRUE(jobsBecome(20));
  waiting.clear();
  EXPECT_TRUE(jobsBecome(RenderThread::kRequestsUnderWay));
  drawn.clear();
  EXPECT_TRUE(jobsBecome(0));
  EXPECT_EQ(server.control().started, RenderThread::kRequestsUnderWay);
}

TEST(Room, WhoWaitsForMemoryIsNeitherTurnedNorPassed) {
  RunningServer server;
  server.control().bands = 20;
  server.control().band_ms = 2;
  server.control().room = 1;
  std::vector<WireClient> clients;
  for (int i = 0; i < 6; ++i) {
    clients.emplace_back(server.port());
    clients.back().send(fmt::format("GET {}?size=64x64&fov={} HTTP/1.1\r\nHost: localhost\r\n\r\n", kRockPath, 20 + i));
  }
  for (WireClient& client : clients) EXPECT_EQ(client.readReply().status, 200);
  EXPECT_EQ(server.control().started, 6);
  EXPECT_GE(server.control().waited, 1);
  EXPECT_EQ(server.control().out_of_turn, 0);
  EXPECT_LE(server.control().most_under_way, 2);  // the one that has the room, and the one that waits for it
}

// Whoever has the memory may take long: only who needs it waits for that.
TEST(Room, ALongFrameAndWhoWaitsForItsMemoryHoldUpNobodyElse) {
  RunningServer server;
  server.control().band_ms = 5;
  server.control().bands = 1000;
  server.control().room = 1;
  const auto ask = [&](WireClient& client, int fov) {
    client.send(fmt::format("GET {}?size=64x64&fov={} HTTP/1.1\r\nHost: localhost\r\n\r\n", kRockPath, fov));
  };
  WireClient holder(server.port());
  ask(holder, 20);
  ASSERT_TRUE(eventually([&] { return server.control().holding == 1; }));
  WireClient waiter(server.port());
  ask(waiter, 21);
  ASSERT_TRUE(eventually([&] { return server.control().waited == 1; }));
  // The others' memory is there.
  server.control().needs_no_room_below = 64 * 64;
  server.control().bands = 1;
  double longest_ms = 0;
  for (int i = 0; i < 20; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(get(server.port(), fmt::format("{}?size=32x32&fov={}", kRockPath, 30 + i)).status, 200);
    longest_ms = std::max(longest_ms,
                          std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
  }
  EXPECT_LT(longest_ms, 500);
  EXPECT_EQ(server.control().out_of_turn, 0);
  EXPECT_EQ(server.control().holding, 1);
}

}  // namespace
}  // namespace blockwalk
