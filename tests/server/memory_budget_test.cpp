// SPDX-License-Identifier: Apache-2.0
// The daemon with less device memory than all that it is asked for needs: parts give way, frames wait for each other,
// and only what does not fit alone is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdio>
#include <string>
#include <thread>

#include "tests/server/daemon_process.h"
#include "tests/server/running_server.h"
#include "tests/server/stream/view_message.h"

namespace blockwalk {
namespace {

std::uint64_t metric(std::uint16_t port, const std::string& name) {
  const std::string text = get(port, "/metrics").body;
  const std::size_t at = text.find("\nblockwalk_" + name + " ");
  return at == std::string::npos ? 0 : std::stoull(text.substr(at + name.size() + 12));
}

class MemoryBudget : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(std::filesystem::exists(kDaemon)) << "build the target blockwalkd"; }

  void start(std::vector<std::string> volumes, std::uint64_t budget, int side = 96) {
    std::vector<std::string> arguments{"--listen", "127.0.0.1:0"};
    if (budget > 0) arguments.insert(arguments.end(), {"--memory-budget", std::to_string(budget)});
    for (const std::string& name : volumes) arguments.push_back(sampleVolume(name, side).string());
    daemon_ = std::make_unique<DaemonProcess>(arguments);
    port_ = daemon_->port();
    ASSERT_NE(port_, 0);
    ASSERT_TRUE(eventually([&] { return get(port_, "/readyz").status == 200; }));
  }
  std::uint64_t used() const { return metric(port_, "device_memory_used_bytes"); }

  void end() {
    daemon_->signal(SIGTERM);
    EXPECT_EQ(daemon_->wait(), 0) << daemon_->seen();
  }

  std::unique_ptr<DaemonProcess> daemon_;
  std::uint16_t port_ = 0;
};

TEST_F(MemoryBudget, ManyViewsOfTwoVolumesAreAllDrawnWithinIt) {
  std::vector<std::string> views;
  for (const char* name : {"rock", "smoke"}) {
    for (const int level : {0, 1}) {
      for (const char* filter : {"nearest", "linear"}) {
        for (const char* finder : {"octree", "query"}) {
          views.push_back(fmt::format("/api/v1/volumes/{}/image?size=48x48&format=raw&level={}&filter={}&finder={}",
                                      name, level, filter, finder));
        }
      }
    }
  }
  start({"rock", "smoke"}, 0);
  std::vector<std::string> expected;
  for (const std::string& view : views) {
    const WireReply reply = get(port_, view);
    ASSERT_EQ(reply.status, 200) << view << reply.body;
    expected.push_back(reply.body);
  }
  const std::uint64_t everything = used();
  EXPECT_GT(metric(port_, "device_memory_part_bytes{part=\"voxels\"}"), everything / 2);

  const std::uint64_t budget = everything * 2 / 3;
  start({"rock", "smoke"}, budget);
  EXPECT_EQ(metric(port_, "device_memory_budget_bytes"), budget);
  const std::uint64_t failed = metric(port_, "failed_requests_total");  // before it was ready
  // One after the other first: making the kernels takes longer than clients wait where many views ask for theirs at
  // once.
  for (std::size_t i = 0; i < views.size(); ++i) {
    const WireReply reply = get(port_, views[i]);
    EXPECT_EQ(reply.status, 200) << views[i] << reply.body;
    EXPECT_EQ(reply.body == expected[i], true) << views[i];
    EXPECT_LE(used(), budget);
  }
  std::atomic<bool> over = false;
  std::uint64_t most = 0;
  std::thread observer([&] {
    while (!over) most = std::max(most, used());
  });
  std::vector<std::thread> clients;
  for (std::size_t client = 0; client < 4; ++client) {
    clients.emplace_back([&, client] {
      for (std::size_t i = 0; i < 2 * views.size(); ++i) {
        const std::size_t number = (i * 5 + client * 7) % views.size();  // each in an order of its own
        const WireReply reply = get(port_, views[number]);
        EXPECT_EQ(reply.status, 200) << views[number] << reply.body;
        EXPECT_EQ(reply.body == expected[number], true) << views[number];
      }
    });
  }
  StreamClient stream(port_, "rock");
  stream.readText("hello");
  for (int id = 1; id <= 40; ++id) {
    stream.sendText(viewMessage(
        id, fmt::format(R"("size":[48,48],"filter":"{}","level":{})", id % 2 == 0 ? "linear" : "nearest", id / 2 % 2)));
    nlohmann::json frame = stream.readFrame();
    if (frame["id"] == id - 1) frame = stream.readFrame();  // that one's still picture
    EXPECT_EQ(frame["id"], id);                             // an error would come in its place
  }
  for (std::thread& client : clients) client.join();
  over = true;
  observer.join();
  EXPECT_LE(most, budget);
  EXPECT_GT(most, budget / 2) << "it is used";
  EXPECT_EQ(metric(port_, "failed_requests_total"), failed);
  end();
}

// A level whose voxels take more than there is room for is drawn all the same: they come and go.
TEST_F(MemoryBudget, AViewWhoseVoxelsTakeMoreIsDrawnAllTheSame) {
  constexpr int kSide = 192;
  start({"rock"}, 0, kSide);
  const std::string view = "/api/v1/volumes/rock/image?size=48x48&format=raw&level=0&filter=";
  const WireReply linear = get(port_, view + "linear");
  ASSERT_EQ(linear.status, 200);
  const std::uint64_t budget = used() * 2 / 3;
  const WireReply fine = get(port_, view + "nearest");
  ASSERT_LT(budget, metric(port_, "device_memory_part_bytes{part=\"voxels\"}"));

  start({"rock"}, budget, kSide);
  for (int round = 0; round < 2; ++round) {
    const WireReply paged = get(port_, view + "linear");
    EXPECT_EQ(paged.status, 200) << paged.body;
    EXPECT_EQ(paged.body == linear.body, true);
    EXPECT_EQ(paged.fields.count("etag"), 1u);
    const auto stats = nlohmann::json::parse(paged.fields.at("x-blockwalk-stats"));
    EXPECT_EQ(stats["complete"], true);
    EXPECT_LE(used(), budget);
    const WireReply drawn = get(port_, view + "nearest");
    EXPECT_EQ(drawn.status, 200) << drawn.body;
    EXPECT_EQ(drawn.body == fine.body, true);
    EXPECT_LE(used(), budget);
  }
  end();
}

// Records of all blocks stay, whatever becomes of voxels.
TEST_F(MemoryBudget, WhatAloneNeedsMoreIsRefusedWithWhatItNeeds) {
  const std::uint64_t budget = std::uint64_t{1} << 20;
  start({"rock"}, budget);
  const std::string view = "/api/v1/volumes/rock/image?format=raw&size=";
  for (int round = 0; round < 2; ++round) {
    const WireReply refused = get(port_, view + "1024x1024&level=1");
    EXPECT_EQ(refused.status, 503) << refused.body;
    EXPECT_EQ(refused.json()["field"], "size") << refused.body;
    const std::size_t words = refused.body.find(" bytes are needed, ");
    ASSERT_NE(words, std::string::npos) << refused.body;
    const std::size_t first = refused.body.find_last_not_of("0123456789", words - 1) + 1;
    unsigned long long needed = 0;
    unsigned long long free = 0;
    ASSERT_EQ(std::sscanf(refused.body.c_str() + first, "%llu bytes are needed, %llu are free", &needed, &free), 2)
        << refused.body;
    EXPECT_GT(needed, free);
    EXPECT_EQ(refused.body.find("bytes are needed", words + 2), std::string::npos) << "once: " << refused.body;
    EXPECT_LE(free, budget);
    EXPECT_LE(used(), budget);
    EXPECT_EQ(get(port_, view + "48x48&level=1").status, 200);
  }
  end();
}

}  // namespace
}  // namespace blockwalk
