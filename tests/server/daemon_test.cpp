// SPDX-License-Identifier: Apache-2.0
// The program itself: its command line, its signals, and the real renderer behind it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "tests/server/daemon_process.h"
#include "tests/server/running_server.h"

namespace blockwalk {
namespace {

class Daemon : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(std::filesystem::exists(kDaemon)) << "build the target blockwalkd"; }
};

bool waitReady(std::uint16_t port) {
  return eventually([&] { return get(port, "/readyz").status == 200; });
}

TEST_F(Daemon, WrongUsageExitsWith2) {
  const std::string no_pem = (scratchFolder() / "no.pem").string();
  std::ofstream(no_pem) << "no certificate";
  const auto large = scratchFolder() / "large-pages";
  std::filesystem::create_directories(large);
  std::ofstream(large / "page") << "x";
  std::filesystem::resize_file(large / "page", (std::uintmax_t{64} << 20) + 1);
  const std::vector<std::pair<std::vector<std::string>, std::string>> wrong = {
      {{"--nonsense"}, "--nonsense"},
      {{"--listen", "0.0.0.0:0"}, "--token-file"},
      {{"--volumes", "/nonexistent"}, "--volumes"},
      {{"--tls-cert", "x"}, "--tls-key"},
      {{"--token-file", "/nonexistent"}, "--token-file"},
      {{"--memory-budget", "1"}, "--memory-budget"},
      {{"--tls-cert", no_pem, "--tls-key", no_pem}, "--tls-cert"},
      {{"--web-root", large.string()}, "--web-root"},
  };
  for (const auto& [arguments, says] : wrong) {
    DaemonProcess daemon(arguments);
    EXPECT_EQ(daemon.wait(), 2);
    EXPECT_THAT(daemon.seen(), testing::StartsWith("blockwalkd: --"));
    EXPECT_THAT(daemon.seen(), testing::HasSubstr(says));
    EXPECT_EQ(std::ranges::count(daemon.seen(), '\n'), 1) << "before a driver is set up: " << daemon.seen();
  }
}

TEST_F(Daemon, HelpListsEveryOption) {
  DaemonProcess daemon({"--help"});
  EXPECT_EQ(daemon.wait(), 0);
  for (const ServerOption& option : serverOptions()) {
    EXPECT_THAT(daemon.seen(), testing::HasSubstr("--" + std::string(option.name)));
  }
}

TEST_F(Daemon, AnAddressInUseExitsWith1) {
  DaemonProcess first({"--listen", "127.0.0.1:0", sampleVolume("rock").string()});
  const std::uint16_t port = first.port();
  ASSERT_NE(port, 0);
  DaemonProcess second({"--listen", fmt::format("127.0.0.1:{}", port)});
  EXPECT_EQ(second.wait(), 1);
  EXPECT_THAT(second.seen(), testing::HasSubstr("cannot listen"));
}

TEST_F(Daemon, AnUnknownDeviceExitsWith1) {
  DaemonProcess daemon({"--listen", "127.0.0.1:0", "--device", "no such device"});
  EXPECT_EQ(daemon.wait(), 1);
  EXPECT_THAT(daemon.seen(), testing::HasSubstr("no such device"));
  EXPECT_THAT(daemon.seen(), testing::Not(testing::HasSubstr("listening")));
}

TEST_F(Daemon, RendersWithTheRealRendererAndDrainsOnSigterm) {
  DaemonProcess daemon(
      {"--listen", "127.0.0.1:0", "--validation", sampleVolume("rock").string(), sampleVolume("smoke").string()});
  const std::uint16_t port = daemon.port();
  ASSERT_NE(port, 0);
  ASSERT_TRUE(waitReady(port));
  const auto black = get(port, "/api/v1/volumes/rock/image?size=64x64&format=raw&extinction=0");
  const auto image = get(port, "/api/v1/volumes/rock/image?size=64x64&format=raw");
  ASSERT_EQ(image.status, 200) << image.body;
  EXPECT_EQ(image.body.size(), 64u * 64u * 4u);
  EXPECT_NE(image.body, black.body);
  EXPECT_EQ(get(port, "/api/v1/volumes/smoke/image?size=32x32&format=jpeg").status, 200);

  StreamClient stream(port, "rock");
  stream.readText("hello");
  stream.sendText(R"({"type":"view","id":1,"size":[64,64]})");
  EXPECT_EQ(stream.readFrame()["id"], 1);
  const auto begin = std::chrono::steady_clock::now();
  daemon.signal(SIGTERM);
  std::optional<WireMessage> message;
  do message = stream.read();
  while (message && message->opcode != 8);
  ASSERT_TRUE(message.has_value());
  EXPECT_EQ(message->closeCode(), 1001);
  EXPECT_EQ(daemon.wait(), 0) << daemon.seen();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(6));
  EXPECT_THAT(daemon.seen(), testing::Not(testing::HasSubstr("VUID")));
}

TEST_F(Daemon, OtherSignalsDoNotEndIt) {
  const auto token_file = scratchFolder() / "daemon-token";
  std::ofstream(token_file) << "0123456789abcdef";
  DaemonProcess daemon({"--listen", "127.0.0.1:0", "--token-file", token_file.string(), sampleVolume("rock").string()});
  const std::uint16_t port = daemon.port();
  ASSERT_NE(port, 0);
  std::ofstream(token_file) << "short";
  daemon.signal(SIGHUP);
  EXPECT_TRUE(daemon.readUntil("reload refused, the token of before stays: --token-file"));
  EXPECT_THAT(daemon.seen(), testing::Not(testing::HasSubstr("request failed")));
  std::ofstream(token_file) << "fedcba9876543210";
  daemon.signal(SIGHUP);
  EXPECT_TRUE(eventually(
      [&] { return get(port, "/api/v1/volumes", "Authorization: Bearer fedcba9876543210\r\n").status == 200; }));
  for (const int number : {SIGUSR1, SIGUSR2}) {
    daemon.signal(number);
    EXPECT_TRUE(daemon.readUntil("connections, "));
  }
  daemon.signal(SIGPIPE);
  daemon.signal(SIGSTOP);
  daemon.signal(SIGCONT);
  EXPECT_EQ(get(port, "/healthz").status, 200);
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0) << daemon.seen();
}

TEST_F(Daemon, ASecondSignalEndsAtOnce) {
  DaemonProcess daemon({"--listen", "127.0.0.1:0", sampleVolume("rock").string()});
  const std::uint16_t port = daemon.port();
  ASSERT_NE(port, 0);
  ASSERT_TRUE(waitReady(port));
  // A request that never ends its body keeps the drain waiting.
  WireClient slow(port);
  slow.send(
      "POST /api/v1/volumes/rock/image HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
      "Content-Length: 100\r\n\r\n{");
  EXPECT_TRUE(eventually([&] { return get(port, "/metrics").body.find("open_connections 2") != std::string::npos; }));
  const auto begin = std::chrono::steady_clock::now();
  daemon.signal(SIGTERM);
  ASSERT_TRUE(daemon.readUntil("draining"));
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 1);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(3));
}

}  // namespace
}  // namespace blockwalk
