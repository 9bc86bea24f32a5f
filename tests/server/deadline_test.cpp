// SPDX-License-Identifier: Apache-2.0
// Images that have a time to be there by, and whether a volume is ready.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "tests/server/running_server.h"

namespace blockwalk {
namespace {

constexpr const char* kTimedImage = "/api/v1/volumes/rock/image";

nlohmann::json timedStats(const WireReply& reply) {
  return nlohmann::json::parse(reply.fields.at("x-blockwalk-stats"));
}

TEST(Deadline, IsNoneWhereThereIsTime) {
  RunningServer server;
  const std::string query = "?size=40x30&samples=4";
  const auto whole = get(server.port(), kTimedImage + query);
  const auto timed = get(server.port(), kTimedImage + query + "&deadline_ms=60000");
  ASSERT_EQ(timed.status, 200);
  EXPECT_TRUE(timed.body == whole.body);
  EXPECT_EQ(timed.fields.at("etag"), whole.fields.at("etag"));
  EXPECT_EQ(timed.fields.at("cache-control"), "no-cache");
  EXPECT_EQ(timedStats(timed)["final"], true);
  EXPECT_EQ(timedStats(timed)["samples"], 4);
  EXPECT_EQ(timedStats(timed)["scale"], 1.0);
  EXPECT_FALSE(timedStats(whole).contains("final"));
  // Samples were added step by step, and what was kept for that is let go.
  const auto steps = server.control().takenSteps();
  ASSERT_EQ(steps.size(), 3u);
  for (const auto& [at, begin, end] : {std::tuple{0u, 0, 1}, {1u, 1, 2}, {2u, 2, 4}}) {
    EXPECT_EQ(steps[at].begin, begin);
    EXPECT_EQ(steps[at].end, end);
  }
  EXPECT_TRUE(eventually([&] { return !server.control().forgotten().empty(); }));
  const auto posted = post(server.port(), kTimedImage, R"({"size":"40x30","samples":4,"deadline_ms":60000})");
  EXPECT_TRUE(posted.body == whole.body);
}

TEST(Deadline, GivesTheBestThatIsThere) {
  RunningServer server;
  server.control().full_pixels = 400 * 300;
  server.control().bands = 40;
  server.control().band_ms = 100;  // 4 s for the whole picture, a sixteenth for the first
  const auto begun = std::chrono::steady_clock::now();
  const auto reply = get(server.port(), std::string(kTimedImage) + "?size=400x300&format=raw&deadline_ms=1500");
  const auto took = std::chrono::steady_clock::now() - begun;
  ASSERT_EQ(reply.status, 200);
  EXPECT_LT(took, std::chrono::milliseconds(3500));
  EXPECT_EQ(timedStats(reply)["final"], false);
  EXPECT_EQ(timedStats(reply)["scale"], 0.25);
  EXPECT_FALSE(reply.fields.contains("etag"));
  EXPECT_EQ(reply.fields.at("cache-control"), "no-store");
  EXPECT_EQ(reply.body.size(), 4u * 400 * 300) << "as large as was asked for";
  // A pixel of the first picture stands for four by four.
  for (int x = 0; x < 400; x += 4) {
    const auto first = static_cast<std::size_t>(4 * x);
    EXPECT_EQ(reply.body.substr(first, 4), reply.body.substr(first + 12, 4));
    EXPECT_EQ(reply.body.substr(first, 4), reply.body.substr(first + 3 * 1600, 4));
  }
  // The first picture is waited for.
  server.control().full_pixels = 0;
  server.control().bands = 1;
  server.control().band_ms = 300;
  const auto late = get(server.port(), std::string(kTimedImage) + "?size=400x300&deadline_ms=1");
  EXPECT_EQ(late.status, 200);
  EXPECT_EQ(timedStats(late)["scale"], 0.25);
}

// Each is one image, and has room for two pictures from its beginning: the one before, and the one that is drawn.
TEST(Deadline, TakesItsRoomOnce) {
  RunningServer server({.files = {sampleVolume("rock")}, .max_image_jobs = 4});  // three of them of one peer
  server.control().band_ms = 150;
  const auto gauge = [&](const std::string& name) {
    const std::string metrics = get(server.port(), "/metrics").body;
    const std::size_t at = metrics.find("\nblockwalk_" + name + " ");
    return at == std::string::npos ? -1 : std::stoll(metrics.substr(at + name.size() + 12));
  };
  const std::string target = std::string(kTimedImage) + "?size=400x300&samples=8&deadline_ms=60000";
  std::vector<std::thread> clients;
  std::atomic<int> whole = 0;
  std::atomic<int> ended = 0;
  for (int i = 0; i < 3; ++i) {
    clients.emplace_back([&] {
      const auto reply = get(server.port(), target);
      if (reply.status == 200 && timedStats(reply)["final"] == true) ++whole;
      ++ended;
    });
  }
  EXPECT_TRUE(eventually([&] { return (server.control().started >= 6 && gauge("image_jobs") >= 3) || ended > 0; }));
  EXPECT_EQ(ended, 0);
  EXPECT_EQ(gauge("image_jobs"), 3);
  EXPECT_EQ(gauge("pending_pixels"), 3 * 2 * 400 * 300);
  EXPECT_EQ(get(server.port(), target).status, 429);
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(whole, 3);
  EXPECT_TRUE(eventually([&] { return gauge("image_jobs") == 0 && gauge("pending_pixels") == 0; }));
}

// Of two pictures at a time no more are let in than fit: 3/4 of 3/4 of a million pixels are one peer's.
TEST(Deadline, IsRefusedWhereBothPicturesHaveNoRoom) {
  RunningServer server({.files = {sampleVolume("rock")}, .max_megapixels = 1});
  server.control().band_ms = 150;
  const std::string target = std::string(kTimedImage) + "?size=500x300&samples=4&deadline_ms=60000";
  std::thread first([&] { EXPECT_EQ(get(server.port(), target).status, 200); });
  EXPECT_TRUE(eventually([&] { return server.control().started > 0; }));
  EXPECT_EQ(get(server.port(), target).status, 429) << "300,000 words of 4 bytes twice";
  EXPECT_EQ(get(server.port(), std::string(kTimedImage) + "?size=500x300").status, 200) << "one more alone fits";
  first.join();
}

TEST(Deadline, IsANumberOfMilliseconds) {
  RunningServer server;
  for (const char* text : {"0", "600001", "1.5", "-1", "soon", ""}) {
    const auto reply = get(server.port(), fmt::format("{}?deadline_ms={}", kTimedImage, text));
    EXPECT_EQ(reply.status, 400) << text;
    EXPECT_EQ(reply.json()["field"], "deadline_ms");
  }
  EXPECT_EQ(get(server.port(), std::string(kTimedImage) + "?deadline_ms=1&deadline_ms=1").json()["field"],
            "deadline_ms");
  for (const char* value : {"0", "1.5", "\"5\"", "null", "[5]"}) {
    const auto reply = post(server.port(), kTimedImage, fmt::format(R"({{"deadline_ms":{}}})", value));
    EXPECT_EQ(reply.status, 400) << value;
    EXPECT_EQ(reply.json()["field"], "deadline_ms");
  }
  EXPECT_EQ(get(server.port(), "/api/v1/volumes/rock/explain?deadline_ms=9").json()["field"], "deadline_ms");
}

TEST(Ready, IsSaidOfOneVolume) {
  RunningServer server({}, false);
  const std::string path = "/api/v1/volumes/rock/ready";
  const auto loading = get(server.port(), path);
  EXPECT_EQ(loading.status, 503);
  EXPECT_TRUE(loading.fields.contains("retry-after"));
  EXPECT_EQ(loading.json()["ready"], false);
  server.waitReady();
  const auto ready = get(server.port(), path);
  EXPECT_EQ(ready.status, 200);
  EXPECT_EQ(ready.json(), nlohmann::json::parse(R"({"id":"rock","ready":true,"state":"ready"})"));
  EXPECT_EQ(get(server.port(), "/api/v1/volumes/none/ready").status, 404);
}

}  // namespace
}  // namespace blockwalk
