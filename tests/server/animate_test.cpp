// SPDX-License-Identifier: Apache-2.0
// Animations by HTTP: their frames are pictures as any other, one at a time, for who is still there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "protocol/animation.h"
#include "tests/server/log_capture.h"
#include "tests/server/running_server.h"

namespace blockwalk {
namespace {

using nlohmann::json;
using testing::HasSubstr;
constexpr const char* kAnimate = "/api/v1/volumes/rock/animate";

std::uint32_t word(const std::string& bytes, std::size_t at, int width = 4) {
  std::uint32_t value = 0;
  for (int i = width; i-- > 0;)
    value = value << 8 | static_cast<unsigned char>(bytes.at(at + static_cast<std::size_t>(i)));
  return value;
}

// The entries as they follow each other, without a look at the directory.
std::vector<std::pair<std::string, std::string>> entriesOf(const std::string& zip) {
  std::vector<std::pair<std::string, std::string>> entries;
  std::size_t at = 0;
  while (word(zip, at) == 0x04034b50) {
    const std::size_t name = word(zip, at + 26, 2);
    const std::size_t bytes = word(zip, at + 18);
    entries.emplace_back(zip.substr(at + 30, name), zip.substr(at + 30 + name, bytes));
    at += 30 + name + bytes;
  }
  EXPECT_EQ(word(zip, at), 0x02014b50u);
  return entries;
}

std::string postOf(const std::string& body, const std::string& more = {}, const std::string& version = "1.1") {
  return fmt::format(
      "POST {} HTTP/{}\r\nHost: localhost\r\nContent-Type: application/json\r\n{}Content-Length: {}\r\n\r\n{}",
      kAnimate, version, more, body.size(), body);
}

// What GET gives for the views of an animation.
std::vector<std::string> singles(std::uint16_t port, const json& animation) {
  const VolumeFile file(sampleVolume("rock"));
  const Film film(readAnimation(animation), file.info());
  std::vector<std::string> pictures;
  for (int i = 0; i < film.frames(); ++i) {
    const auto reply = get(port, "/api/v1/volumes/rock/image?" + viewQuery({.view = film.view(i)}));
    EXPECT_EQ(reply.status, 200) << reply.body;
    pictures.push_back(reply.body);
  }
  return pictures;
}

TEST(Animate, HasTheBytesOfSinglePictures) {
  RunningServer server;
  const json keys = {{{"seconds", 0}, {"view", {{"eye", {50, 60, 170}}}}},
                     {{"seconds", 1}, {"view", {{"eye", {150, 40, 20}}, {"mode", "mip"}}}}};
  for (const json& animation : {json{{"frames", 4}, {"size", {40, 30}}, {"view", {{"fov", 30}}}},
                                json{{"fps", 3}, {"size", {30, 40}}, {"keys", keys}}}) {
    const auto reply = post(server.port(), kAnimate, animation.dump());
    ASSERT_EQ(reply.status, 200) << reply.body;
    EXPECT_EQ(reply.fields.at("content-type"), "application/zip");
    EXPECT_EQ(reply.fields.at("content-disposition"), "attachment; filename=\"rock.zip\"");
    EXPECT_EQ(reply.fields.at("cache-control"), "no-store");
    EXPECT_EQ(json::parse(reply.fields.at("x-blockwalk-animation"))["frames"], 4);
    const auto entries = entriesOf(reply.body);
    const std::vector<std::string> expected = singles(server.port(), animation);
    ASSERT_EQ(entries.size(), 4u);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_EQ(entries[i].first, fmt::format("frame{:04}.png", i));
      EXPECT_TRUE(entries[i].second == expected[i]) << i;
    }
    EXPECT_FALSE(entries[1].second == entries[0].second);
  }
}

TEST(Animate, GoesOnTheSameConnection) {
  RunningServer server;
  WireClient client(server.port());
  for (int i = 0; i < 2; ++i) {
    client.send(postOf(R"({"frames":2,"size":[8,6]})"));
    EXPECT_EQ(entriesOf(client.readReply().body).size(), 2u);
  }
  client.send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(client.readReply().status, 200);
}

TEST(Animate, IsAWebp) {
  RunningServer server;
  const auto reply = post(server.port(), kAnimate, R"({"frames":3,"size":[40,30],"format":"webp","quality":100})");
  ASSERT_EQ(reply.status, 200) << reply.body;
  EXPECT_EQ(reply.fields.at("content-type"), "image/webp");
  EXPECT_EQ(reply.body.substr(0, 4), "RIFF");
  EXPECT_EQ(word(reply.body, 4) + 8, reply.body.size());
  std::size_t frames = 0;
  for (std::size_t at = reply.body.find("ANMF"); at != std::string::npos; at = reply.body.find("ANMF", at + 4))
    ++frames;
  EXPECT_EQ(frames, 3u);
  // HTTP/1.0 has no chunks, and takes what has a length.
  EXPECT_EQ(request(server.port(), postOf(R"({"frames":1,"size":[4,3],"format":"webp"})", "", "1.0")).status, 200);
  const auto old = request(server.port(), postOf(R"({"frames":1,"size":[4,3]})", "", "1.0"));
  EXPECT_EQ(old.status, 505);
  EXPECT_EQ(old.json()["field"], "version");
}

TEST(Animate, RefusesByMemberAndBound) {
  RunningServer server({.body_limit = 4096});
  const auto fault = [&](const std::string& body) {
    const auto reply = post(server.port(), kAnimate, body);
    return fmt::format("{} {}: {}", reply.status, reply.json().value("field", ""),
                       reply.json()["detail"].get<std::string>());
  };
  for (const auto& [body, expected] : {
           std::pair<std::string, const char*>{"", "400 body: "},
           {"[]", "400 an animation: "},
           {"{\"fps\":1e999}", "400 fps: "},
           {"{\"fps\":1,\"fps\":1}", "400 fps: "},
           {R"({"frames":0})", "400 frames: frames: must be from 1 to 3600, not 0"},
           {R"({"frames":3601})", "400 frames: "},
           {R"({"size":[0,9]})", "400 size: "},
           {R"({"keys":{}})", "400 keys: "},
           {R"({"keys":[{"seconds":0,"view":{"mode":"x"}}]})", "400 mode: "},
           {R"({"view":{"level":17}})", "400 level: "},
           {R"({"view":{"output":"depth"}})", "400 output: "},
           {R"({"turntable":{"axis":[0,0,0]}})", "400 axis: "},
           {R"({"format":"raw"})", "400 format: "},
           {R"({"frames":3600,"size":[8192,8192]})", "400 frames: frames: 3600 in 8 seconds"},
           {R"({"frames":960,"size":[8192,8192]})", "413 frames: 960 frames of 8192x8192 are "},
           {R"({"format":"webp","frames":960,"size":[400,300]})", "413 frames: "},
           {std::string(5000, ' '), "413 body: "},
       }) {
    EXPECT_THAT(fault(body), testing::StartsWith(expected)) << body;
  }
  std::string deep = R"({"view":)";
  for (int i = 0; i < 2000; ++i) deep += '[';
  EXPECT_THAT(fault(deep), testing::StartsWith("400 "));
  EXPECT_EQ(post(server.port(), kAnimate, "{}", "text/plain").status, 415);
  EXPECT_EQ(get(server.port(), kAnimate).status, 405);
  EXPECT_EQ(post(server.port(), std::string(kAnimate) + "?frames=1", "{}").status, 400);
  EXPECT_EQ(post(server.port(), "/api/v1/volumes/none/animate", "{}").status, 404);
  EXPECT_EQ(request(server.port(), postOf("{}", "Accept: image/png\r\n")).status, 406);
  EXPECT_EQ(request(server.port(), fmt::format("POST {} HTTP/1.1\r\nHost: elsewhere.example\r\nContent-Type: "
                                               "application/json\r\nContent-Length: 2\r\n\r\n{{}}",
                                               kAnimate))
                .status,
            403);
  EXPECT_EQ(server.control().started, 0) << "nothing was drawn for any of them";
}

TEST(Animate, NeedsTheToken) {
  const auto file = scratchFolder() / "token";
  std::ofstream(file) << "a-token-of-24-characters";
  std::filesystem::permissions(file, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  RunningServer server({.token_file = file.string()});
  const std::string body = R"({"frames":1,"size":[4,3]})";
  EXPECT_EQ(request(server.port(), postOf(body)).status, 401);
  EXPECT_EQ(request(server.port(), postOf(body, "Authorization: Bearer a-token-of-24-characters\r\n")).status, 200);
}

TEST(Animate, DrawsNoMoreThanTheReaderTakes) {
  RunningServer server;
  WireClient client(server.port());
  client.send(postOf(R"({"frames":900,"size":[1000,1000]})"));
  ASSERT_EQ(client.readHead().status, 200);
  int drawn = 0;
  EXPECT_TRUE(eventually([&] {
    const int before = std::exchange(drawn, server.control().started.load());
    std::this_thread::sleep_for(std::chrono::milliseconds(1000));
    return drawn == before;
  })) << "it waits for its reader";
  EXPECT_LT(drawn, 900);
  EXPECT_EQ(server.control().under_way, 0);
  EXPECT_EQ(get(server.port(), "/api/v1/volumes/rock/image?size=64x48").status, 200);
}

// In the middle of a frame that takes ten seconds.
TEST(Animate, EndsWhenItsClientLeaves) {
  LogCapture log;
  auto server = std::make_unique<RunningServer>();
  FakeControl& control = server->control();
  for (const char* format : {"zip", "webp"}) {
    control.bands = 1;
    control.band_ms = 1;
    const int cancelled = control.cancelled;
    {
      const int before = control.started;
      WireClient client(server->port());
      client.send(postOf(fmt::format(R"({{"frames":500,"size":[64,48],"format":"{}"}})", format)));
      ASSERT_TRUE(eventually([&] { return control.started > before + 3; }));
      control.bands = 500;
      control.band_ms = 20;
      std::this_thread::sleep_for(std::chrono::milliseconds(300));
      while (client.hasBytes()) ASSERT_TRUE(client.readBytes(1));  // else it would leave with a reset
    }
    const auto left = std::chrono::steady_clock::now();
    EXPECT_TRUE(eventually([&] { return control.under_way == 0; })) << format;
    EXPECT_LT(std::chrono::steady_clock::now() - left, std::chrono::seconds(5)) << format;
    EXPECT_EQ(control.cancelled, cancelled + 1) << format;
  }
  server.reset();
  EXPECT_EQ(log.count("ends early"), 0) << "that is nobody's fault";
}

TEST(Animate, AreTwoOfAPeerAtATime) {
  RunningServer server;
  server.control().band_ms = 30;
  std::vector<WireClient> clients;
  for (int i = 0; i < 2; ++i) {
    clients.emplace_back(server.port());
    clients.back().send(postOf(R"({"frames":200,"size":[8,6]})"));
    EXPECT_EQ(clients.back().readHead().status, 200);
  }
  const auto refused = post(server.port(), kAnimate, R"({"frames":1,"size":[8,6]})");
  EXPECT_EQ(refused.status, 429);
  EXPECT_TRUE(refused.fields.contains("retry-after"));
  EXPECT_EQ(get(server.port(), "/api/v1/volumes/rock/image?size=8x8").status, 200);
  clients.pop_back();
  EXPECT_TRUE(eventually([&] { return post(server.port(), kAnimate, R"({"frames":1,"size":[8,6]})").status == 200; }));
}

TEST(Animate, WhatFailsMidwayIsCutShort) {
  LogCapture log;
  auto server = std::make_unique<RunningServer>();
  server->control().band_ms = 20;
  WireClient client(server->port());
  client.send(postOf(R"({"frames":300,"size":[8,6]})"));
  ASSERT_EQ(client.readHead().status, 200);
  ASSERT_TRUE(client.readChunk());
  server->control().fail_device = true;
  std::optional<std::string> chunk;
  do {
    chunk = client.readChunk();
  } while (chunk && !chunk->empty());
  EXPECT_FALSE(chunk) << "no last chunk: the client knows";
  EXPECT_TRUE(client.atEnd());
  // What fails at once is a status.
  EXPECT_EQ(post(server->port(), kAnimate, R"({"frames":2,"size":[8,6]})").status, 503);
  server.reset();
  EXPECT_EQ(log.count("an animation ends early"), 1);
}

TEST(Animate, EndsWithTheServer) {
  auto server = std::make_unique<RunningServer>();
  server->control().band_ms = 20;
  WireClient client(server->port());
  client.send(postOf(R"({"frames":900,"size":[8,6]})"));
  ASSERT_EQ(client.readHead().status, 200);
  const auto begun = std::chrono::steady_clock::now();
  server->drain();
  EXPECT_EQ(server->join(), 0);
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(8)) << "and not with its last frame";
}

}  // namespace
}  // namespace blockwalk
