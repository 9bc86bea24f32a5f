// SPDX-License-Identifier: Apache-2.0
// What passes does not stay: a device that is lost, memory that runs out, files that break, are replaced or come back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>

#include "tests/server/log_capture.h"
#include "tests/server/running_server.h"
#include "tests/server/stream/view_message.h"

namespace blockwalk {
namespace {

using Fault = FakeControl::Fault;
using nlohmann::json;
constexpr const char* kRockPicture = "/api/v1/volumes/rock/image?size=4x4";

std::filesystem::path copyOf(const std::string& sample, const std::string& name) {
  auto copy = scratchFolder() / name;
  std::filesystem::copy_file(sampleVolume(sample), copy, std::filesystem::copy_options::overwrite_existing);
  return copy;
}

// So many more clients, each of which has asked for a picture that no other asks for, and waits for it: who closes is
// not drawn for.
void ask(std::vector<WireClient>& clients, const RunningServer& server, int count,
         const std::string& path = kRockPicture) {
  for (int i = 0; i < count; ++i) {
    const std::size_t fov = 30 + clients.size();
    clients.emplace_back(server.port());
    clients.back().send(fmt::format("GET {}&fov={} HTTP/1.1\r\nHost: localhost\r\n\r\n", path, fov));
  }
}

// Three times in short order, each by a frame of its own. Only those before the last are answered: the process ends.
void failThreeFrames(RunningServer& server, Fault fault) {
  std::vector<WireClient> clients;
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(eventually([&] { return i == 0 || get(server.port(), "/readyz").status == 200; }));
    server.control().failCall(fault, 1);
    ask(clients, server, 1);
    if (i < 2) clients.back().readReply();
  }
  EXPECT_EQ(server.join(), 1);
}

// The calls of a frame: begin, and one advance a band.
constexpr int kBands = 3;

class LostDevice : public testing::TestWithParam<int> {};

TEST_P(LostDevice, IsOpenedAgainAndSessionsGoOn) {
  RunningServer server;
  server.control().bands = kBands;
  StreamClient stream(server.port(), "rock");
  stream.sendText(viewMessage(1, R"("size":[64,48])"));
  while (stream.readFrame()["final"] == false) {
  }
  server.control().failCall(Fault::lost, GetParam());
  const auto lost = get(server.port(), std::string(kRockPicture) + "&fov=31");
  EXPECT_EQ(lost.status, 503) << "whose work it was";
  EXPECT_TRUE(lost.fields.contains("retry-after"));
  EXPECT_TRUE(eventually([&] { return get(server.port(), "/readyz").status == 200; }));
  EXPECT_EQ(server.control().opened, 2);
  EXPECT_EQ(server.control().loads, 2);
  EXPECT_EQ(get(server.port(), std::string(kRockPicture) + "&fov=31").status, 200);
  stream.sendText(viewMessage(2, R"("fov":32)"));
  json frame;
  do frame = stream.readFrame();
  while (frame["final"] == false);
  EXPECT_EQ(frame["id"], 2);
  EXPECT_THAT(get(server.port(), "/metrics").body, testing::HasSubstr("blockwalk_device_losses_total 1\n"));
}

INSTANTIATE_TEST_SUITE_P(EachCallInTurn, LostDevice, testing::Range(1, 1 + kBands + 1));

TEST(Recovery, OthersWhoseFramesWereUnderWayNoticeNothing) {
  RunningServer server;
  server.control().bands = 40;
  server.control().band_ms = 5;
  std::vector<WireClient> clients;
  ask(clients, server, 3);
  EXPECT_TRUE(eventually([&] { return server.control().under_way == 3; }));
  server.control().failCall(Fault::lost, 1);
  std::map<int, int> statuses;
  for (WireClient& client : clients) ++statuses[client.readReply().status];
  EXPECT_EQ(statuses[200], 2);
  EXPECT_EQ(statuses[503], 1);
}

TEST(Recovery, AStreamWhoseOwnFrameLostTheDeviceGoesOn) {
  RunningServer server;
  StreamClient stream(server.port(), "rock");
  stream.readText("hello");
  server.control().failCall(Fault::lost, 1);
  stream.sendText(viewMessage(1));
  const json error = stream.readText("error");
  EXPECT_EQ(error["id"], 1);
  EXPECT_EQ(error["problem"]["status"], 503);
  EXPECT_TRUE(eventually([&] { return get(server.port(), "/readyz").status == 200; }));
  EXPECT_EQ(server.control().opened, 2);
  stream.sendText(viewMessage(2, R"("fov":31)"));
  EXPECT_EQ(stream.readFrame()["id"], 2);
}

// Two clients whose pictures of that path are being drawn when the device is lost: what both are told.
std::vector<std::string> lostWithTwoUnderWay(RunningServer& server, const std::string& path,
                                             const std::function<void()>& meanwhile) {
  server.control().bands = 4000;
  server.control().band_ms = 5;
  std::vector<WireClient> clients;
  ask(clients, server, 2, path);
  EXPECT_TRUE(eventually([&] { return server.control().under_way == 2; }));
  meanwhile();
  server.control().failCall(Fault::lost, 1);
  std::vector<std::string> details;
  for (WireClient& client : clients) {
    const WireReply reply = client.readReply();
    EXPECT_EQ(reply.status, 503);
    details.push_back(reply.json()["detail"]);
  }
  server.control().bands = 1;
  return details;
}

TEST(Recovery, WhoWaitsForAVolumeThatDoesNotComeBackIsTold) {
  const auto path = copyOf("rock", "gone.bwv");
  RunningServer server({.files = {path}});
  const auto details =
      lostWithTwoUnderWay(server, "/api/v1/volumes/gone/image?size=4x4", [&] { std::filesystem::remove(path); });
  EXPECT_THAT(details, testing::UnorderedElementsAre(testing::HasSubstr("was told to be lost"),
                                                     testing::HasSubstr("the volume failed: ")));
  EXPECT_EQ(get(server.port(), "/readyz").json()["volumes"]["gone"], "failed");
}

TEST(Recovery, WhoWaitsForAContentThatWasReplacedIsTold) {
  const auto path = copyOf("rock", "old.bwv");
  RunningServer server({.files = {path}});
  const auto details = lostWithTwoUnderWay(server, "/api/v1/volumes/old/image?size=4x4", [&] {
    std::filesystem::rename(copyOf("smoke", "new.bwv"), path);
    EXPECT_TRUE(eventually([&] { return get(server.port(), "/api/v1/volumes/old").json()["type"] == "f32"; }));
  });
  EXPECT_THAT(details, testing::UnorderedElementsAre(testing::HasSubstr("was told to be lost"),
                                                     testing::HasSubstr("was replaced")));
  EXPECT_TRUE(eventually([&] { return get(server.port(), "/api/v1/volumes/old/image?size=4x4").status == 200; }));
}

TEST(Recovery, ADeviceThatIsLostAgainAndAgainEndsTheServer) {
  RunningServer server;
  failThreeFrames(server, Fault::lost);
}

// A kernel may still write where it was told to, and the driver may never return from destroying what it uses.
TEST(Recovery, ADeviceThatHangsIsLeftBehind) {
  RunningServer server;
  server.expectDeviceLeftBehind();
  server.control().bands = 40;
  server.control().band_ms = 5;
  server.control().hold_destruction = true;
  std::vector<WireClient> clients;
  ask(clients, server, 2);
  EXPECT_TRUE(eventually([&] { return server.control().under_way == 2; }));
  server.control().failCall(Fault::hangs, 1);
  EXPECT_TRUE(eventually([&] { return server.control().opened == 2; })) << "nobody waits for what hangs";
  std::map<int, int> statuses;
  for (WireClient& client : clients) ++statuses[client.readReply().status];
  EXPECT_EQ(statuses[200], 1);
  EXPECT_EQ(statuses[503], 1);
  EXPECT_EQ(server.control().destroyed_hung, 0);
  server.control().hold_destruction = false;
}

TEST(Recovery, DevicesThatHangAreLeftBehindAFewTimes) {
  RunningServer server;
  server.expectDeviceLeftBehind();
  failThreeFrames(server, Fault::hangs);
  EXPECT_EQ(server.control().opened, 3);
  EXPECT_EQ(server.control().destroyed_hung, 0);
}

TEST(Recovery, MemoryOfTheDeviceThatRunsOutIsThisRequestsAlone) {
  RunningServer server;
  for (int call = 1; call <= 2; ++call) {
    server.control().failCall(Fault::out_of_memory, call);
    const auto full = get(server.port(), std::string(kRockPicture) + "&fov=31");
    EXPECT_EQ(full.status, 503);
    const std::string detail = full.json()["detail"];
    EXPECT_EQ(detail,
              "the device has too little memory: the fake device is full: 123456 bytes are needed, 789 are free");
    EXPECT_EQ(full.json()["field"], "level");
    EXPECT_EQ(get(server.port(), std::string(kRockPicture) + "&fov=31").status, 200);
    EXPECT_EQ(server.control().under_way, 0);
  }
  EXPECT_EQ(server.control().opened, 1);
}

class PassingFault : public testing::TestWithParam<Fault> {};

TEST_P(PassingFault, WhileLoadingIsTriedAgain) {
  RunningServer server({}, false, {});
  server.control().failCall(GetParam(), 1, GetParam() == Fault::lost ? 1 : 2);
  server.control().hold_load = false;
  EXPECT_TRUE(eventually([&] { return get(server.port(), "/readyz").status == 200; }));
  EXPECT_EQ(get(server.port(), kRockPicture).status, 200);
}

INSTANTIATE_TEST_SUITE_P(Each, PassingFault,
                         testing::Values(Fault::lost, Fault::out_of_memory, Fault::bad_alloc, Fault::data));

TEST(Recovery, AVolumeThatBrokeComesBackAndItsStreamsToo) {
  RunningServer server;
  StreamClient stream(server.port(), "rock");
  server.control().failCall(Fault::data, 1);
  stream.sendText(viewMessage(1));
  const json error = stream.readText("error");
  EXPECT_EQ(error["problem"]["status"], 503);
  EXPECT_THAT(std::string(error["problem"]["detail"]), testing::HasSubstr("the file is broken"));
  EXPECT_TRUE(eventually([&] { return get(server.port(), kRockPicture).status == 503; })) << "it failed";
  EXPECT_TRUE(eventually([&] { return get(server.port(), kRockPicture).status == 200; })) << "and came back";
  stream.sendText(viewMessage(2, R"("fov":31)"));
  EXPECT_EQ(stream.readFrame()["id"], 2);
}

TEST(Recovery, AFileThatIsReplacedIsServedAsANewContent) {
  const auto path = copyOf("rock", "replaced.bwv");
  RunningServer server({.files = {path}});
  const std::string target = "/api/v1/volumes/replaced";
  const auto before = get(server.port(), target + "/image?size=4x4");
  ASSERT_EQ(before.status, 200);
  StreamClient stream(server.port(), "replaced");
  stream.readText("hello");
  std::filesystem::rename(copyOf("smoke", "aside.bwv"), path);
  EXPECT_TRUE(eventually([&] { return get(server.port(), target).json()["type"] == "f32"; }));
  const auto after =
      get(server.port(), target + "/image?size=4x4", "If-None-Match: " + before.fields.at("etag") + "\r\n");
  EXPECT_EQ(after.status, 200);
  EXPECT_NE(after.fields.at("etag"), before.fields.at("etag"));
  std::optional<WireMessage> message;
  do message = stream.read();
  while (message && message->opcode != 8);
  ASSERT_TRUE(message.has_value());
  EXPECT_EQ(message->closeCode(), 1012);
}

std::string warningOf(std::uint16_t port, std::size_t number = 0) {
  return get(port, "/api/v1/volumes").json()["volumes"][number].value("warning", "");
}

TEST(Recovery, AReplacementThatIsNoVolumeLeavesTheOldOne) {
  const auto path = copyOf("rock", "kept.bwv");
  const LogCapture log;
  {
    RunningServer server({.files = {path}});
    const std::string target = "/api/v1/volumes/kept/image?size=4x4";
    const std::string etag = get(server.port(), target).fields.at("etag");
    EXPECT_EQ(warningOf(server.port()), "");
    const auto broken = scratchFolder() / "broken-aside.bwv";
    std::ofstream(broken) << "this is no volume";
    std::filesystem::rename(broken, path);
    ASSERT_TRUE(eventually([&] { return !warningOf(server.port()).empty(); }));
    EXPECT_THAT(warningOf(server.port()),
                testing::AllOf(testing::StartsWith("replacement refused, the old content is served on: kept.bwv"),
                               testing::Not(testing::HasSubstr("/"))));
    const json volume = get(server.port(), "/api/v1/volumes/kept").json();
    EXPECT_EQ(volume["state"], "ready");
    EXPECT_EQ(volume["warning"], warningOf(server.port()));
    EXPECT_EQ(get(server.port(), target + "&fov=31").status, 200);
    EXPECT_EQ(get(server.port(), target).fields.at("etag"), etag);
    std::filesystem::rename(copyOf("smoke", "aside2.bwv"), path);
    EXPECT_TRUE(eventually([&] { return get(server.port(), "/api/v1/volumes/kept").json()["type"] == "f32"; }));
    EXPECT_EQ(warningOf(server.port()), "");
  }
  EXPECT_EQ(log.count("replacement refused"), 1) << log.text();
  EXPECT_EQ(log.count("failed"), 0) << "nothing did: " << log.text();
}

TEST(Recovery, AReplacementThatBreaksWhileItIsLoadedIsNoFailureOfTheOldOne) {
  const auto path = copyOf("rock", "late.bwv");
  const LogCapture log;
  {
    RunningServer server({.files = {path}});
    server.control().failCall(Fault::data, 1);
    std::filesystem::rename(copyOf("smoke", "aside4.bwv"), path);
    EXPECT_TRUE(eventually([&] { return get(server.port(), "/api/v1/volumes/late").json()["type"] == "f32"; }))
        << "at the next try";
  }
  EXPECT_EQ(log.count("replacement refused, the old content is served on: "), 1) << log.text();
  EXPECT_EQ(log.count("failed"), 0) << log.text();
}

TEST(Recovery, AFileThatIsGoneIsToldOnceAndSoIsItsReturn) {
  const std::vector<std::filesystem::path> paths = {copyOf("rock", "gone.bwv"), copyOf("smoke", "gone-too.bwv")};
  const auto aside = scratchFolder() / "gone-aside.bwv";
  const LogCapture log;
  {
    RunningServer server({.files = paths});
    const std::uint16_t port = server.port();
    std::filesystem::rename(paths[0], aside);
    ASSERT_TRUE(eventually([&] { return !warningOf(port).empty(); }));
    EXPECT_EQ(warningOf(port), "the file is gone, what is on the device is served on: No such file or directory");
    EXPECT_EQ(get(port, "/api/v1/volumes/gone").json()["warning"], warningOf(port));
    EXPECT_EQ(get(port, "/api/v1/volumes/gone/image?size=4x4").status, 200);
    EXPECT_EQ(warningOf(port, 1), "");
    std::filesystem::remove(paths[1]);
    ASSERT_TRUE(eventually([&] { return !warningOf(port, 1).empty(); })) << "the first was looked at again meanwhile";
    std::filesystem::rename(aside, paths[0]);
    EXPECT_TRUE(eventually([&] { return warningOf(port).empty(); }));
    EXPECT_FALSE(get(port, "/api/v1/volumes/gone").json().contains("warning"));
  }
  EXPECT_EQ(log.count("volume gone: the file is gone"), 1) << log.text();
  EXPECT_EQ(log.count("volume gone: the file is back"), 1) << log.text();
  EXPECT_EQ(log.count("volume gone: ready"), 1) << "it is the same content: " << log.text();
}

TEST(Recovery, AFileThatComesLaterIsServed) {
  const auto path = scratchFolder() / "later.bwv";
  std::filesystem::remove(path);
  RunningServer server({.files = {path}}, false);
  server.control().hold_load = false;
  EXPECT_TRUE(eventually([&] { return get(server.port(), "/readyz").json()["volumes"]["later"] == "failed"; }));
  std::filesystem::rename(copyOf("rock", "aside3.bwv"), path);
  EXPECT_TRUE(eventually([&] { return get(server.port(), "/readyz").status == 200; }));
}

TEST(Recovery, VolumesLoadWhileFramesAreDrawn) {
  RunningServer server({.files = {sampleVolume("rock"), sampleVolume("smoke")}}, false);
  server.control().hold_load = false;
  ASSERT_TRUE(eventually([&] { return get(server.port(), "/readyz").status == 200; }));
  server.control().hold_load = true;  // what is loaded from now on takes its time
  server.control().failCall(Fault::data, 1);
  get(server.port(), "/api/v1/volumes/smoke/image?size=4x4");
  EXPECT_TRUE(eventually([&] { return server.control().loads == 3; }));
  EXPECT_EQ(get(server.port(), kRockPicture).status, 200) << "while the other loads";
  EXPECT_EQ(get(server.port(), "/api/v1/volumes/smoke/image?size=4x4").status, 503);
  server.control().hold_load = false;
  EXPECT_TRUE(eventually([&] { return get(server.port(), "/api/v1/volumes/smoke/image?size=4x4").status == 200; }));
}

TEST(Recovery, SumsOfAStreamThatEndedAreLetGo) {
  RunningServer server;
  {
    StreamClient stream(server.port(), "rock");
    stream.sendText(viewMessage(1, R"("size":[64,48],"samples":4)"));
    stream.readFrame();
    EXPECT_TRUE(eventually([&] { return !server.control().takenSteps().empty(); }));
  }
  ASSERT_TRUE(eventually([&] { return !server.control().forgotten().empty(); }));
  EXPECT_EQ(server.control().forgotten()[0], server.control().takenSteps()[0].owner);
}

// Jobs queued, under way and being encoded, sockets half read, streams: all are destroyed with the server.
TEST(Recovery, AServerIsDestroyedWithAllThatItHasToDo) {
  for (int round = 0; round < 3; ++round) {
    RunningServer server({.drain_time = 1});
    server.control().bands = 100;
    server.control().band_ms = 20;
    std::vector<WireClient> clients;
    ask(clients, server, 12);
    clients.emplace_back(server.port());
    clients.back().send("GET /healthz HTT");
    StreamClient stream(server.port(), "rock");
    stream.sendText(viewMessage(1));
    EXPECT_TRUE(eventually([&] { return server.control().under_way >= RenderThread::kRequestsUnderWay + 1; }));
  }
}

}  // namespace
}  // namespace blockwalk
