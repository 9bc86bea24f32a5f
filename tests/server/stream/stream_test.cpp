// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <span>

#include "protocol/stream_messages.h"
#include "tests/server/running_server.h"
#include "tests/server/stream/view_message.h"

namespace blockwalk {
namespace {

using nlohmann::json;

TEST(Stream, SaysHelloThenShowsTheViewAndRefinesIt) {
  RunningServer server;
  StreamClient client(server.port(), "rock");
  ASSERT_EQ(client.reply().status, 101);
  EXPECT_EQ(client.reply().fields.at("sec-websocket-protocol"), "blockwalk.v1");
  const json hello = client.readText("hello");
  EXPECT_EQ(hello["version"], "blockwalk.v1");
  EXPECT_EQ(hello["volume"]["id"], "rock");
  client.sendText(viewMessage(7));
  const json moving = client.readFrame();
  EXPECT_EQ(moving["id"], 7);
  EXPECT_EQ(moving["seq"], 1);
  EXPECT_EQ(moving["final"], false);
  EXPECT_EQ(moving["format"], "jpeg");
  EXPECT_EQ(moving["width"], std::lround(64 * moving["scale"].get<double>()));
  const json final = client.readFrame();
  EXPECT_EQ(final["id"], 7);
  EXPECT_EQ(final["final"], true);
  EXPECT_EQ(final["format"], "png");
  EXPECT_EQ(final["width"], 64);
  EXPECT_EQ(final["height"], 48);
  EXPECT_EQ(final["scale"], 1);
  client.sendText(R"({"type":"ping","t":12.5})");
  EXPECT_EQ(client.readText("pong")["t"], 12.5);
}

TEST(Stream, StatsFollowTheirFinalFrame) {
  RunningServer server;
  StreamClient client(server.port(), "rock");
  std::int64_t newest = 0;  // frame
  for (int id = 1; id <= 3; ++id) {
    client.sendText(viewMessage(id, R"("fov":)" + std::to_string(30 + id) + R"(,"size":[64,48])"));
    std::int64_t stats = 0;
    while (stats == 0) {
      const auto message = client.read();
      ASSERT_TRUE(message.has_value());
      if (message->opcode == 2) {
        newest = parseFrameMessage(std::as_bytes(std::span(message->payload))).header.seq;
        client.sendText(fmt::format(R"({{"type":"ack","id":{}}})", id));
      } else if (const json text = json::parse(message->payload); text["type"] == "stats") {
        stats = text["seq"];
        EXPECT_EQ(text["id"], id);
      }
    }
    EXPECT_EQ(stats, newest) << "the frame that the stats are of came before them";
  }
}

TEST(Stream, ThePlainPathSaysWhyNoStreamOpens) {
  RunningServer server({.max_sessions = 1});
  const std::string path = "/api/v1/volumes/rock/stream";
  EXPECT_EQ(get(server.port(), path).status, 426);
  StreamClient first(server.port(), "rock");
  first.readText("hello");
  const auto full = get(server.port(), path);
  EXPECT_EQ(full.status, 429);
  EXPECT_EQ(full.fields.at("retry-after"), "1");
}

TEST(Stream, APatchKeepsTheOtherMembers) {
  RunningServer server;
  StreamClient client(server.port(), "rock");
  client.sendText(viewMessage(1, R"("size":[64,48],"format":"raw")"));
  client.sendText(viewMessage(2, R"("fov":30)"));
  json frame;
  do frame = client.readFrame();
  while (frame["final"] == false);
  EXPECT_EQ(frame["id"], 2);
  EXPECT_EQ(frame["format"], "raw");
  EXPECT_EQ(client.lastImageBytes(), 64u * 48u * 4u);
}

TEST(Stream, WebpIsWebpMovingAndStill) {
  RunningServer server;
  StreamClient client(server.port(), "rock");
  client.sendText(viewMessage(1, R"("size":[64,48],"format":"webp","background":"00000080")"));
  json frame;
  do {
    frame = client.readFrame();
    EXPECT_EQ(frame["format"], "webp");
  } while (frame["final"] == false);
}

// A quarter of the pixels fits beside the other's frame, all of them do not.
TEST(Stream, AMovingViewWaitsForNoMoreRoomThanItsFrameTakes) {
  RunningServer server({.max_megapixels = 2});
  server.control().bands = 10000;
  server.control().band_ms = 5;
  StreamClient slow(server.port(), "rock");
  slow.readText("hello");
  slow.sendText(viewMessage(1));
  ASSERT_TRUE(eventually([&] { return server.control().under_way == 1; }));
  server.control().bands = 1;
  StreamClient large(server.port(), "rock");
  large.readText("hello");
  large.sendText(viewMessage(1, R"("size":[2048,2048])"));
  EXPECT_EQ(large.readFrame()["width"], 1024);
  EXPECT_EQ(server.control().under_way, 1);
}

TEST(Stream, TheLatestViewWins) {
  RunningServer server;
  server.control().band_ms = 40;
  StreamClient client(server.port(), "rock");
  constexpr int kViews = 200;
  for (int id = 1; id <= kViews; ++id)
    client.sendText(viewMessage(id, R"("size":[64,48],"eye":[9,9,)" + std::to_string(id) + "]"));
  std::int64_t last_id = 0, last_seq = 0;
  json frame;
  int frames = 0;
  do {
    frame = client.readFrame();
    EXPECT_GE(frame["id"], last_id) << "a frame never goes back";
    EXPECT_EQ(frame["seq"], last_seq + 1);
    last_id = frame["id"];
    last_seq = frame["seq"];
    ++frames;
  } while (frame["final"] == false);
  EXPECT_EQ(frame["id"], kViews);
  EXPECT_LT(frames, 20) << "views that nobody waits for are not drawn";
  EXPECT_GT(frame["dropped"], 150);
}

TEST(Stream, ARefinementIsCancelledByANewView) {
  RunningServer server;
  server.control().bands = 200;
  server.control().band_ms = 20;
  server.control().full_pixels = 640 * 480;  // a full frame takes 4 s, the first coarse one 1 s
  StreamClient client(server.port(), "rock");
  client.sendText(viewMessage(1, R"("size":[640,480])"));
  EXPECT_EQ(client.readFrame()["final"], false);
  EXPECT_TRUE(eventually([&] { return server.control().started >= 2; }));  // the view stands still and is refined
  const auto begin = std::chrono::steady_clock::now();
  client.sendText(viewMessage(2, R"("fov":30)"));
  EXPECT_EQ(client.readFrame()["id"], 2);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(2500));
  EXPECT_EQ(server.control().cancelled, 1);
}

TEST(Stream, NoMoreThanThreeFramesAreInFlight) {
  RunningServer server;
  StreamClient client(server.port(), "rock");
  client.sendText(R"({"type":"limits","fps":120})");
  for (int id = 1; id <= 40; ++id) {
    client.sendText(viewMessage(id));
    std::this_thread::sleep_for(std::chrono::milliseconds(15));
  }
  EXPECT_EQ(server.control().finished, 3);
  json frame;
  for (int i = 0; i < 3; ++i) frame = client.readFrame(false);
  client.sendText(fmt::format(R"({{"type":"ack","id":{}}})", frame["id"].get<int>()));
  frame = client.readFrame(false);
  EXPECT_EQ(frame["id"], 40) << "the newest view was kept";
}

TEST(Stream, ErrorsNameTheFieldAndTheViewStands) {
  RunningServer server;
  StreamClient client(server.port(), "rock");
  client.sendText(viewMessage(5));
  client.readFrame();
  const std::vector<std::tuple<std::string, std::string, int>> bad = {
      {"", "", -1},
      {"nonsense", "", -1},
      {R"({"type":"view","id":5})", "id", 5},
      {R"({"type":"view","id":4})", "id", 4},
      {R"({"type":"view","id":-1})", "id", -1},
      {R"({"type":"view","id":9007199254740993})", "id", -1},
      {R"({"type":"view","id":6,"nonsense":1})", "nonsense", 6},
      {R"({"type":"view","id":6,"size":[0,1]})", "size", 6},
      {R"({"type":"view","id":6,"eye":[1,1,1],"target":[1,1,1]})", "target", 6},
      {R"({"type":"view","id":6,"fov":30,"fov":30})", "fov", -1},
      {R"({"type":"view","id":6,"level":17})", "level", 6},
      {R"({"type":"ack","id":99})", "id", 99},
      {R"({"type":"limits","fps":0})", "fps", -1},
      {R"({"type":"ping"})", "t", -1},
      {R"({"type":"shout"})", "type", -1},
      {std::string(60000, '['), "", -1},
      {R"({"a":"\ud800"})", "", -1},
  };
  for (const auto& [text, field, id] : bad) {
    client.sendText(text);
    const json error = client.readText("error");
    EXPECT_EQ(error["problem"]["status"], 400) << text;
    EXPECT_EQ(error["problem"].value("field", ""), field) << text;
    EXPECT_EQ(error.value("id", -1), id) << text;
    EXPECT_EQ(get(server.port(), "/healthz").status, 200);
  }
  client.sendText(viewMessage(6, R"("fov":31)"));
  json frame;
  do frame = client.readFrame();
  while (frame["id"] != 6 || frame["final"] == false);
  EXPECT_EQ(frame["width"], 64) << "the size of the first view still stands";
}

TEST(Stream, AFrameThatFailsIsReportedAndTheNextViewIsTried) {
  RunningServer server;
  StreamClient client(server.port(), "rock");
  server.control().fail_device = true;
  client.sendText(viewMessage(1));
  EXPECT_EQ(client.readText("error")["problem"]["status"], 503);
  server.control().fail_device = false;
  client.sendText(viewMessage(2, R"("fov":30)"));
  EXPECT_EQ(client.readFrame()["id"], 2);
}

struct BadFrame {
  const char* name;
  std::string bytes;
  int close_code;
};

void PrintTo(const BadFrame& bad, std::ostream* out) { *out << bad.name; }

class BadFrames : public testing::TestWithParam<BadFrame> {};

// All are masked with zeros, so that the bytes are the payload's own.
std::string masked(const std::string& head, const std::string& payload = "") {
  return head + std::string(4, '\0') + payload;
}

const BadFrame kBadFrames[] = {
    {"unmasked", "\x81\x02{}", 1002},
    {"reserved_bit", masked("\xc1\x82", "{}"), 1002},
    {"opcode_3", masked("\x83\x80"), 1002},
    {"fragmented_ping", masked(std::string("\x09\x80", 2)), 1002},
    {"long_ping", masked(std::string("\x89\xfe\x00\x7e", 4), std::string(126, 'x')), 1002},
    {"continuation_first", masked("\x80\x82", "{}"), 1002},
    {"not_utf8", masked("\x81\x82", "\xff\xfe"), 1007},
    {"announced_2_63", masked(std::string("\x81\xff\x7f\xff\xff\xff\xff\xff\xff\xff", 10)), 1009},
    {"too_long", masked(std::string("\x81\xff\x00\x00\x00\x00\x00\x04\x00\x01", 10)), 1009},
    {"close_1005", masked("\x88\x82", "\x03\xed"), 1002},
    {"close_999", masked("\x88\x82", "\x03\xe7"), 1002},
    {"close_1_byte", masked("\x88\x81", "\x03"), 1002},
};

TEST_P(BadFrames, CloseTheStreamAndNothingElse) {
  static RunningServer server;
  StreamClient second(server.port(), "rock");
  StreamClient client(server.port(), "rock");
  client.readText("hello");
  client.sendBytes(GetParam().bytes);
  std::optional<WireMessage> message = client.read();
  ASSERT_TRUE(message.has_value());
  EXPECT_EQ(message->closeCode(), GetParam().close_code);
  second.sendText(viewMessage(1));
  EXPECT_EQ(second.readFrame()["id"], 1);
}

INSTANTIATE_TEST_SUITE_P(Table, BadFrames, testing::ValuesIn(kBadFrames),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(Stream, ManyBadMessagesCloseTheStream) {
  RunningServer server;
  StreamClient client(server.port(), "rock");
  for (int i = 0; i < 300; ++i) client.sendText("");
  std::optional<WireMessage> message;
  do message = client.read();
  while (message && message->opcode != 8);
  ASSERT_TRUE(message.has_value());
  EXPECT_EQ(message->closeCode(), 1008);
}

TEST(Stream, AClientThatVanishesIsLetGo) {
  RunningServer server;
  server.control().band_ms = 50;
  for (int i = 0; i < 20; ++i) {
    StreamClient client(server.port(), "rock");
    client.sendText(viewMessage(1, R"("size":[512,512])"));
    if (i % 2 == 0) client.readFrame();
  }
  EXPECT_TRUE(eventually(
      [&] { return get(server.port(), "/metrics").body.find("blockwalk_open_sessions 0\n") != std::string::npos; }));
}

// It asks for a picture that no socket holds, and for answers, and reads nothing: it is cut off, and holds nothing
// more.
TEST(Stream, AClientThatNeverReadsIsLetGo) {
  ServerOptions options;
  options.send_time = 1;
  RunningServer server(options);
  StreamClient client(server.port(), "rock");
  client.sendText(viewMessage(1, R"("size":[4096,4096],"format":"raw")"));
  for (int i = 0; i < 64; ++i) client.sendText(R"({"type":"ping","t":1})");
  const auto metrics = [&] { return get(server.port(), "/metrics").body; };
  EXPECT_TRUE(eventually([&] { return metrics().find("blockwalk_sent_bytes_total 0\n") == std::string::npos; }));
  EXPECT_TRUE(eventually([&] { return metrics().find("blockwalk_open_sessions 0\n") != std::string::npos; }));
}

TEST(Stream, AFrameOfAClientThatVanishedIsGivenUp) {
  RunningServer server;
  server.control().bands = 1000;
  server.control().band_ms = 10;
  {
    StreamClient client(server.port(), "rock");
    client.readText("hello");
    client.sendText(viewMessage(1));
    EXPECT_TRUE(eventually([&] { return server.control().under_way == 1; }));
  }
  EXPECT_TRUE(eventually([&] { return server.control().cancelled == 1; }));
}

TEST(Stream, StreamsBeyondTheBoundAreRefused) {
  RunningServer server({.max_sessions = 2});
  StreamClient first(server.port(), "rock");
  StreamClient second(server.port(), "rock");
  first.readText("hello");
  second.readText("hello");
  EXPECT_EQ(StreamClient(server.port(), "rock").reply().status, 429);
}

TEST(Stream, SessionsShareTheDevice) {
  RunningServer server;
  server.control().band_ms = 10;
  StreamClient busy(server.port(), "rock");
  StreamClient other(server.port(), "rock");
  for (int id = 1; id <= 50; ++id) busy.sendText(viewMessage(id, R"("fov":)" + std::to_string(20 + id)));
  other.sendText(viewMessage(1));
  EXPECT_EQ(other.readFrame()["id"], 1);
}

TEST(Stream, DrainingClosesWith1001) {
  RunningServer server;
  server.control().band_ms = 200;
  StreamClient client(server.port(), "rock");
  client.readText("hello");
  client.sendText(viewMessage(1));
  EXPECT_TRUE(eventually([&] { return server.control().started > 0; }));
  server.drain();
  EXPECT_EQ(client.readFrame(false)["id"], 1) << "the frame under way is sent";
  const auto message = client.read();
  ASSERT_TRUE(message.has_value());
  EXPECT_EQ(message->closeCode(), 1001);
  client.sendFrame(0x88, message->payload);
  EXPECT_EQ(server.join(), 0);
}

}  // namespace
}  // namespace blockwalk
