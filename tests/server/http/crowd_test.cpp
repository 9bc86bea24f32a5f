// SPDX-License-Identifier: Apache-2.0
// More connections than there may be, silent ones and greedy ones: the server is never deaf.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/running_server.h"
#include "tests/server/stream/view_message.h"

namespace blockwalk {
namespace {

constexpr const char* kSmallPicture = "/api/v1/volumes/rock/image?size=4x4";

void openSilent(std::vector<WireClient>& clients, int count, std::uint16_t port, std::string_view begun = {}) {
  for (int i = 0; i < count; ++i) {
    clients.emplace_back(port);
    clients.back().send(begun);
  }
}

// Connections whose pictures take longer than the test.
std::vector<WireClient> fillPlaces(RunningServer& server, int count) {
  server.control().bands = 1000;
  server.control().band_ms = 5;
  std::vector<WireClient> busy;
  for (int i = 0; i < count; ++i) {
    busy.emplace_back(server.port());
    busy.back().send(fmt::format("GET {}&fov={} HTTP/1.1\r\nHost: localhost\r\n\r\n", kSmallPicture, 30 + i));
  }
  EXPECT_TRUE(eventually([&] { return server.control().under_way == count; }));
  return busy;
}

TEST(Crowd, SilentConnectionsMakePlaceForNewOnes) {
  RunningServer server({.max_connections = 16});
  std::vector<WireClient> silent;
  openSilent(silent, 64, server.port());
  for (int i = 0; i < 10; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_EQ(get(server.port(), "/healthz").status, 200);
    EXPECT_EQ(get(server.port(), kSmallPicture).status, 200);
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(1));
  }
  EXPECT_TRUE(silent.front().atEnd()) << "the longest silent went first";
  EXPECT_THAT(get(server.port(), "/metrics").body, testing::Not(testing::HasSubstr("evicted_connections_total 0\n")));
}

TEST(Crowd, KeptAliveConnectionsAreEvictedByTheirSilence) {
  RunningServer server({.max_connections = 4});
  std::vector<WireClient> clients;
  for (int i = 0; i < 4; ++i) {
    clients.emplace_back(server.port());
    clients.back().send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
    EXPECT_EQ(clients.back().readReply().status, 200);
  }
  clients[0].send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");  // the second is silent for longest now
  EXPECT_EQ(clients[0].readReply().status, 200);
  EXPECT_EQ(get(server.port(), "/healthz").status, 200);
  EXPECT_TRUE(clients[1].atEnd());
  clients[0].send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(clients[0].readReply().status, 200);
}

TEST(Crowd, HeadersThatDripHoldNobodyUp) {
  RunningServer server({.max_connections = 8});
  std::vector<WireClient> dripping;
  openSilent(dripping, 40, server.port(), "GET /healthz HTT");
  EXPECT_EQ(get(server.port(), "/healthz").status, 200);
}

// All places are taken by those that are being served: only who watches, and who is known, gets one beyond.
TEST(Crowd, PlacesAreKeptForProbesAndForWhoIsKnown) {
  RunningServer server({.max_connections = 3});
  const std::vector<WireClient> busy = fillPlaces(server, 3);
  EXPECT_EQ(get(server.port(), "/healthz").status, 200);
  EXPECT_EQ(get(server.port(), "/readyz").status, 200);
  const auto refused = get(server.port(), "/api/v1/volumes");
  EXPECT_EQ(refused.status, 503);
  EXPECT_TRUE(refused.fields.contains("retry-after"));
  EXPECT_EQ(refused.fields.at("connection"), "close");
}

TEST(Crowd, WhoHasAStreamIsKnown) {
  RunningServer server({.max_connections = 3});
  StreamClient stream(server.port(), "rock");
  stream.readText("hello");
  const std::vector<WireClient> busy = fillPlaces(server, 3);
  EXPECT_EQ(get(server.port(), "/api/v1/volumes").status, 200);
}

TEST(Crowd, WhoAsksForTooMuchIsClosed) {
  RunningServer server({.max_image_jobs = 1});
  server.control().bands = 100;
  server.control().band_ms = 5;
  WireClient first(server.port());
  first.send(fmt::format("GET {} HTTP/1.1\r\nHost: localhost\r\n\r\n", kSmallPicture));
  ASSERT_TRUE(eventually([&] { return server.control().started > 0; }));
  WireClient second(server.port());
  second.send(fmt::format("GET {}&fov=31 HTTP/1.1\r\nHost: localhost\r\n\r\n", kSmallPicture));
  EXPECT_EQ(second.readReply().status, 429);
  EXPECT_TRUE(second.atEnd());
  EXPECT_EQ(first.readReply().status, 200);
}

// It keeps sending views, but reads and acknowledges nothing.
TEST(Crowd, AStreamThatAcknowledgesNothingIsClosed) {
  ServerOptions options;
  options.send_time = 1;
  RunningServer server(options);
  StreamClient client(server.port(), "rock");
  client.readText("hello");
  const auto begin = std::chrono::steady_clock::now();
  const auto open = [&] {
    return get(server.port(), "/metrics").body.find("blockwalk_open_sessions 1\n") != std::string::npos;
  };
  int id = 0;
  while (open() && std::chrono::steady_clock::now() - begin < std::chrono::seconds(8)) {
    client.sendText(viewMessage(++id, R"("size":[64,48])"));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  std::optional<WireMessage> message;
  do message = client.read();
  while (message && message->opcode != 8);
  ASSERT_TRUE(message.has_value());
  EXPECT_EQ(message->closeCode(), 1008);
}

TEST(Crowd, MessagesAreBoundedInBytesToo) {
  ServerOptions options;
  options.message_bytes = 128 << 10;
  RunningServer server(options);
  StreamClient client(server.port(), "rock");
  client.readText("hello");
  const auto begin = std::chrono::steady_clock::now();
  const std::string padding(50000, ' ');
  for (int i = 0; i < 12; ++i) client.sendText(fmt::format(R"({{"type":"ping",{}"t":{}}})", padding, i));
  for (int i = 0; i < 12; ++i) EXPECT_EQ(client.readText("pong")["t"], i);
  const auto took = std::chrono::steady_clock::now() - begin;
  EXPECT_GE(took, std::chrono::milliseconds(2500)) << "600 kB at 128 KiB a second";
}

}  // namespace
}  // namespace blockwalk
