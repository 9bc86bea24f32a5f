// SPDX-License-Identifier: Apache-2.0
// What a view that moves on would show is brought in between its frames, while nobody waits for anything else.
#include <gtest/gtest.h>

#include <functional>
#include <regex>

#include "tests/server/running_server.h"
#include "tests/server/stream/view_message.h"

namespace blockwalk {
namespace {

bool soon(const std::function<bool()>& holds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!holds() && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  return holds();
}

std::string eyeAt(double x) { return fmt::format(R"("size":[64,48],"eye":[{},20,300],"target":[{},20,0])", x, x); }

// Shows the view and waits for its moving frame.
void move(StreamClient& client, int id, double x) {
  client.sendText(viewMessage(id, eyeAt(x)));
  EXPECT_EQ(client.readFrame()["id"], id);
  client.sendText(fmt::format(R"({{"type":"ack","id":{}}})", id));
}

std::uint64_t metric(std::uint16_t port, const std::string& name) {
  const std::string text = get(port, "/metrics").body;
  std::smatch found;
  EXPECT_TRUE(std::regex_search(text, found, std::regex("\nblockwalk_" + name + " ([0-9]+)"))) << name;
  return std::stoull(found[1]);
}

TEST(LookAhead, WhereAViewMovesOnToIsBroughtIn) {
  RunningServer server;
  server.control().paged = true;
  server.control().ahead_pieces = 3;
  StreamClient client(server.port(), "rock");
  move(client, 1, 10);
  move(client, 2, 13);
  ASSERT_TRUE(soon([&] { return server.control().viewsAhead().size() >= 4; }));
  const std::vector<ResolvedView> views = server.control().viewsAhead();
  const double expected[] = {16, 19, 25, 37};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(views[i].camera.eye.x, expected[i], 1e-9);
  EXPECT_TRUE(soon([&] { return metric(server.port(), "pages_ahead_total") == 4; }));
  // It stands still from now on: nothing more comes.
  EXPECT_EQ(client.readFrame()["final"], true);
  EXPECT_EQ(server.control().viewsAhead().size(), 4u);
}

TEST(LookAhead, WhoeverWantsAPictureComesFirst) {
  RunningServer server;
  server.control().paged = true;
  server.control().ahead_pieces = 1 << 20;  // for ever
  StreamClient client(server.port(), "rock");
  move(client, 1, 10);
  move(client, 2, 13);
  ASSERT_TRUE(soon([&] { return server.control().viewsAhead().size() == 1; }));
  EXPECT_EQ(get(server.port(), "/api/v1/volumes/rock/image?size=64x48").status, 200) << "of somebody else";
  EXPECT_EQ(server.control().viewsAhead().size(), 1u) << "and it goes on afterwards";
  move(client, 3, 16);
  ASSERT_TRUE(soon([&] { return server.control().viewsAhead().size() == 2; }));
  EXPECT_NEAR(server.control().viewsAhead()[1].camera.eye.x, 19, 1e-9) << "from where it is now";
  EXPECT_EQ(client.readFrame()["final"], true);
}

TEST(LookAhead, ItEndsWithItsClient) {
  RunningServer server;
  server.control().paged = true;
  server.control().ahead_pieces = 1 << 20;
  {
    StreamClient client(server.port(), "rock");
    move(client, 1, 10);
    move(client, 2, 13);
    ASSERT_TRUE(soon([&] { return server.control().viewsAhead().size() == 1; }));
  }
  EXPECT_TRUE(soon([&] { return metric(server.port(), "open_sessions") == 0; }));
}

TEST(LookAhead, WhatDoesNotComeAndGoIsNotBroughtIn) {
  RunningServer server;
  StreamClient client(server.port(), "rock");
  move(client, 1, 10);
  move(client, 2, 13);
  EXPECT_EQ(client.readFrame()["final"], true);
  EXPECT_TRUE(server.control().viewsAhead().empty());
}

}  // namespace
}  // namespace blockwalk
