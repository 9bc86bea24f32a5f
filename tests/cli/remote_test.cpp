// SPDX-License-Identifier: Apache-2.0
// `info` and `render` with a URL, against a server that gives one fixed answer.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "tests/cli/run_binary.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

// Answers every connection with the same bytes, on a port of its own, until it is destroyed.
class FixedServer {
 public:
  explicit FixedServer(std::string answer) : answer_(std::move(answer)), listener_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(bind(listener_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(listen(listener_, 4), 0);
    EXPECT_EQ(getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { serve(); });
  }
  ~FixedServer() {
    shutdown(listener_, SHUT_RDWR);
    thread_.join();
    close(listener_);
  }
  FixedServer(const FixedServer&) = delete;
  FixedServer& operator=(const FixedServer&) = delete;

  std::string url(const std::string& path) const { return "http://127.0.0.1:" + std::to_string(port_) + path; }
  // The head of the last request; read it after the client has ended.
  std::string request() const {
    const std::lock_guard lock(mutex_);
    return request_;
  }

 private:
  void serve() {
    for (;;) {
      const int peer = accept(listener_, nullptr, nullptr);
      if (peer < 0) return;
      std::string request;
      char buffer[4096];
      while (request.find("\r\n\r\n") == std::string::npos) {
        const ssize_t got = recv(peer, buffer, sizeof buffer, 0);
        if (got <= 0) break;
        request.append(buffer, static_cast<std::size_t>(got));
      }
      {
        const std::lock_guard lock(mutex_);
        request_ = request;
      }
      send(peer, answer_.data(), answer_.size(), MSG_NOSIGNAL);
      shutdown(peer, SHUT_WR);
      while (recv(peer, buffer, sizeof buffer, 0) > 0) {
      }
      close(peer);
    }
  }

  std::string answer_;
  int listener_;
  int port_ = 0;
  mutable std::mutex mutex_;
  std::string request_;
  std::thread thread_;
};

std::string answerOf(const std::string& status, const std::string& headers, const std::string& body) {
  return "HTTP/1.1 " + status + "\r\n" + headers + "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
}

TEST(Remote, InfoAsksForTheVolume) {
  const Workplace place;
  ASSERT_EQ(place.run("demo smoke -o smoke.bwv --size 24").exit_code, 0);
  const std::string info = place.run("info smoke.bwv --json").out;
  const FixedServer server(answerOf("200 OK", "Content-Type: application/json\r\n", info));
  for (const char* path : {"/smoke", "/api/v1/volumes/smoke"}) {
    const Outcome outcome = place.run("info --json " + server.url(path));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.error;
    EXPECT_EQ(outcome.out, info);
    EXPECT_THAT(server.request(), StartsWith("GET /api/v1/volumes/smoke HTTP/1.1\r\n"));
  }
  EXPECT_EQ(place.run("info " + server.url("/smoke")).out, place.run("info smoke.bwv").out);
}

TEST(Remote, RenderSendsTheViewAndKeepsTheImage) {
  const Workplace place;
  const std::string image("\x89PNG\0pixels", 11);
  const FixedServer server(answerOf("200 OK", "X-Blockwalk-Stats: {\"rays\": 12}\r\n", image));
  const Outcome outcome =
      place.run("render " + server.url("/smoke") + " -o a.png --stats s.json --size 4x3 --range 1:2 --repeat 2");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.error;
  EXPECT_EQ(place.read("a.png"), image);
  EXPECT_EQ(nlohmann::json::parse(place.read("s.json"))["rays"], 12);
  EXPECT_THAT(server.request(), StartsWith("GET /api/v1/volumes/smoke/image?"));
  EXPECT_THAT(server.request(), HasSubstr("size=4x3"));
  EXPECT_THAT(server.request(), HasSubstr("range=1:2"));
  EXPECT_THAT(outcome.out, HasSubstr("total_ms"));
}

TEST(Remote, SaysWhatTheServerRefuses) {
  const Workplace place;
  const std::string type = "Content-Type: application/problem+json\r\n";
  const FixedServer absent(
      answerOf("404 Not Found", type, R"({"status": 404, "detail": "no volume is called smoke"})"));
  const Outcome missing = place.run("info " + absent.url("/smoke"));
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.error, HasSubstr("404: no volume is called smoke"));
  const FixedServer strict(
      answerOf("400 Bad Request", type, R"({"status": 400, "detail": "9 is not within 0..3", "field": "level"})"));
  const Outcome refused = place.run("render " + strict.url("/smoke") + " -o a.png --level 9");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.error, HasSubstr("--level: 9 is not within 0..3"));
  EXPECT_FALSE(std::filesystem::exists(place.path("a.png")));
}

TEST(Remote, SurvivesNonsense) {
  const Workplace place;
  const std::string answers[] = {"",
                                 "220 mail.example.org\r\n",
                                 "HTTP/1.1 200 OK\r\nContent-Length: 99\r\n\r\ncut",
                                 answerOf("200 OK", "", "no json"),
                                 answerOf("200 OK", "", "[1,2]"),
                                 answerOf("200 OK", "", R"({"name": 5})"),
                                 "HTTP/1.1 200 OK\r\nContent-Length: 99999999999999\r\n\r\n"};
  for (const std::string& answer : answers) {
    const FixedServer server(answer);
    const Outcome outcome = place.run("info " + server.url("/smoke"));
    EXPECT_EQ(outcome.exit_code, 1) << answer;
    EXPECT_THAT(outcome.error, HasSubstr("127.0.0.1")) << answer;
  }
}

}  // namespace
}  // namespace blockwalk
