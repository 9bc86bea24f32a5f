// SPDX-License-Identifier: Apache-2.0
// Refinement of a still view by samples: the steps that a client sees, and the pictures that the real renderer gives.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/running_server.h"
#include "tests/server/stream/view_message.h"

namespace blockwalk {
namespace {

using nlohmann::json;

std::vector<std::pair<int, int>> rangesOf(const std::vector<SampleStep>& steps) {
  std::vector<std::pair<int, int>> ranges;
  for (const SampleStep& step : steps) ranges.emplace_back(step.begin, step.end);
  return ranges;
}

TEST(Refine, StepsComeInOrderAndTheLastIsFinal) {
  RunningServer server;
  StreamClient client(server.port(), "rock");
  client.sendText(viewMessage(7, R"("size":[64,48],"samples":9)"));
  const json moving = client.readFrame();
  EXPECT_EQ(moving["samples"], 1);
  EXPECT_EQ(moving["final"], false);
  std::int64_t seq = moving["seq"];
  for (int samples : {1, 2, 4, 8, 9}) {
    const json step = client.readFrame();
    EXPECT_EQ(step["id"], 7);
    EXPECT_EQ(step["seq"], ++seq);
    EXPECT_EQ(step["samples"], samples);
    EXPECT_EQ(step["scale"], 1);
    EXPECT_EQ(step["width"], 64);
    EXPECT_EQ(step["final"], samples == 9);
    EXPECT_EQ(step["format"], samples == 9 ? "png" : "jpeg");
  }
  EXPECT_EQ(client.readText("stats")["seq"], seq);
  const std::vector<SampleStep> steps = server.control().takenSteps();
  EXPECT_THAT(rangesOf(steps), testing::ElementsAre(testing::Pair(0, 1), testing::Pair(1, 2), testing::Pair(2, 4),
                                                    testing::Pair(4, 8), testing::Pair(8, 9)));
  for (const SampleStep& step : steps) EXPECT_EQ(step.owner, steps[0].owner);
  EXPECT_EQ(server.control().fewest_samples, 1) << "while moving";
}

TEST(Refine, ClientsHaveSumsOfTheirOwn) {
  RunningServer server;
  StreamClient first(server.port(), "rock"), second(server.port(), "rock");
  for (StreamClient* client : {&first, &second}) {
    client->sendText(viewMessage(1, R"("size":[64,48],"samples":2)"));
    while (client->readFrame()["final"] == false) {
    }
  }
  const std::vector<SampleStep> steps = server.control().takenSteps();
  ASSERT_EQ(steps.size(), 4u);
  EXPECT_NE(steps[0].owner, steps[3].owner);
}

TEST(Refine, APictureTooLargeForSumsComesInOneStep) {
  RunningServer server;
  StreamClient client(server.port(), "rock");
  client.sendText(viewMessage(1, R"("size":[8192,2049],"samples":4,"format":"jpeg")"));
  EXPECT_EQ(client.readFrame()["samples"], 1);
  const json final = client.readFrame();
  EXPECT_EQ(final["samples"], 4);
  EXPECT_EQ(final["final"], true);
  EXPECT_TRUE(server.control().takenSteps().empty());
  EXPECT_EQ(server.control().samples, 4);
}

TEST(Refine, StepsWaitWhileThreeFramesAreInFlight) {
  RunningServer server;
  StreamClient client(server.port(), "rock");
  client.sendText(viewMessage(1, R"("size":[64,48],"samples":16)"));
  for (int i = 0; i < 3; ++i) client.readFrame(false);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_EQ(server.control().finished, 3);
  client.sendText(R"({"type":"ack","id":1})");
  EXPECT_EQ(client.readFrame(false)["samples"], 4) << "none was left out";
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(server.control().finished, 4) << "an acknowledgement makes one place";
}

TEST(Refine, ANewViewBetweenStepsEndsThem) {
  RunningServer server;
  StreamClient client(server.port(), "rock");
  client.sendText(viewMessage(1, R"("size":[64,48],"samples":16)"));
  for (int i = 0; i < 3; ++i) client.readFrame(false);  // the next step waits
  client.sendText(viewMessage(2, R"("fov":30)"));
  for (int i = 0; i < 3; ++i) client.sendText(R"({"type":"ack","id":1})");
  json frame = client.readFrame();
  EXPECT_EQ(frame["id"], 2);
  EXPECT_EQ(frame["final"], false);
  for (int samples : {1, 2, 4, 8, 16}) EXPECT_EQ(client.readFrame()["samples"], samples);
  const auto ranges = rangesOf(server.control().takenSteps());
  ASSERT_EQ(ranges.size(), 7u);
  EXPECT_EQ(ranges[1], (std::pair{1, 2}));
  EXPECT_EQ(ranges[2], (std::pair{0, 1})) << "it starts over";
}

TEST(Refine, ANewViewCancelsTheStepUnderWay) {
  RunningServer server;
  StreamClient client(server.port(), "rock");
  client.sendText(viewMessage(1, R"("size":[64,48],"samples":16)"));
  for (int i = 0; i < 3; ++i) client.readFrame(false);  // the next step waits
  server.control().bands = 200;
  server.control().band_ms = 10;  // a frame takes 2 s
  const int started = server.control().started;
  client.sendText(R"({"type":"ack","id":1})");
  EXPECT_TRUE(eventually([&] { return server.control().started > started; }));
  client.sendText(viewMessage(2, R"("fov":30)"));
  EXPECT_EQ(client.readFrame(false)["id"], 2);  // unacknowledged, so that its own steps wait
  EXPECT_EQ(server.control().cancelled, 1);
  EXPECT_EQ(server.control().takenSteps().back().end, 4);
}

// Over the real renderer, with small bands, and with little room for sums where a test asks for it.
class RefinedPictures : public testing::Test {
 protected:
  static constexpr const char* kLook = "size=200x150&samples=7&background=10203040";
  static constexpr const char* kMembers = R"("size":[200,150],"samples":7,"background":"10203040","format":"raw")";

  void start(std::uint64_t kept_sum_bytes) {
    server_.reset();
    server_ = std::make_unique<RunningServer>(ServerOptions{}, true, [this, kept_sum_bytes] {
      DeviceOptions options;
      options.validation = true;
      options.band_ms = 3;
      options.kept_sum_bytes = kept_sum_bytes;
      options.on_message = [this](const std::string& text) { messages_ += text; };
      return createRenderer(options);
    });
  }
  void TearDown() override {
    server_.reset();
    EXPECT_THAT(messages_, testing::Not(testing::HasSubstr("VUID")));
    EXPECT_THAT(messages_, testing::Not(testing::HasSubstr("SYNC-")));
  }
  std::string got(int fov) {
    const auto reply = get(server_->port(), fmt::format("/api/v1/volumes/rock/image?{}&fov={}&format=raw", kLook, fov));
    EXPECT_EQ(reply.status, 200) << reply.body;
    return reply.body;
  }
  static std::string finalOf(StreamClient& client, int id) {
    json frame;
    do frame = client.readFrame();
    while (frame["id"] != id || frame["final"] == false);
    return client.lastImage();
  }
  static std::string viewOf(int id, int fov) { return viewMessage(id, fmt::format(R"({},"fov":{})", kMembers, fov)); }

  std::string messages_;
  std::unique_ptr<RunningServer> server_;
};

TEST_F(RefinedPictures, TheLastStepIsWhatGetGives) {
  start(DeviceOptions{}.kept_sum_bytes);
  StreamClient client(server_->port(), "rock");
  client.sendText(viewOf(1, 30));
  const std::string final = finalOf(client, 1);
  EXPECT_EQ(final.size(), 200u * 150 * 4);
  EXPECT_TRUE(final == got(30));
  const json stats = client.readText("stats")["stats"];
  const auto whole = get(server_->port(), fmt::format("/api/v1/volumes/rock/image?{}&fov=30&format=raw", kLook));
  const json expected = json::parse(whole.fields.at("x-blockwalk-stats"));
  for (const char* count : {"rays", "voxel_steps", "block_visits", "subblock_visits", "queries"}) {
    EXPECT_EQ(stats[count], expected[count]) << count;
  }
}

TEST_F(RefinedPictures, ChangedAndChangedBackMixesNothing) {
  start(DeviceOptions{}.kept_sum_bytes);
  const std::string narrow = got(30), wide = got(50);
  EXPECT_FALSE(narrow == wide);
  StreamClient client(server_->port(), "rock");
  client.sendText(viewOf(1, 30));
  while (client.readFrame()["samples"] != 2) {
  }
  client.sendText(viewOf(2, 50));
  json frame;
  do frame = client.readFrame();
  while (frame["id"] != 2 || frame["samples"] != 4);
  client.sendText(viewOf(3, 30));
  client.sendText(viewOf(4, 50));
  client.sendText(viewOf(5, 30));
  EXPECT_TRUE(finalOf(client, 5) == narrow);
  client.sendText(viewOf(6, 50));
  EXPECT_TRUE(finalOf(client, 6) == wide);
}

TEST_F(RefinedPictures, TwoClientsAtOnceGetTheirOwn) {
  const std::uint64_t one = 200 * 150 * kSumBytes;
  for (std::uint64_t room : {2 * one, one, one - 1}) {  // for both, for either, for none
    start(room);
    StreamClient first(server_->port(), "rock"), second(server_->port(), "rock");
    first.sendText(viewOf(1, 30));
    second.sendText(viewOf(1, 50));
    std::string other;
    std::jthread reader([&] { other = finalOf(second, 1); });
    EXPECT_TRUE(finalOf(first, 1) == got(30)) << room;
    reader.join();
    EXPECT_TRUE(other == got(50)) << room;
  }
}

}  // namespace
}  // namespace blockwalk
