// SPDX-License-Identifier: Apache-2.0
// `info` and `render` with a URL, against a server that gives one fixed answer.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/cli/fixed_server.h"
#include "tests/cli/run_binary.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

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

TEST(Remote, AnIpv6AddressIsWrittenInBrackets) {
  const FixedServer server(answerOf("200 OK", "", "{}"), {.ipv6 = true});
  if (!server.isListening()) GTEST_SKIP() << "no ::1 here";
  const Workplace place;
  EXPECT_EQ(place.run("info --json '" + server.url("/smoke") + "'").exit_code, 0);
  EXPECT_THAT(server.request(), HasSubstr("\r\nHost: [::1]:" + std::to_string(server.port()) + "\r\n"));
  EXPECT_THAT(place.run("info 'http://[::1]:1/smoke'").error, HasSubstr("http://[::1]:1: no answer"));
}

TEST(Remote, TheTokenIsOfTheFlagElseOfTheEnvironment) {
  const Workplace place;
  const FixedServer server(answerOf("200 OK", "", "{}"));
  EXPECT_EQ(place.run("info --json " + server.url("/smoke")).exit_code, 0);
  EXPECT_THAT(server.request(), Not(HasSubstr("Authorization")));
  EXPECT_EQ(place.run("info --json --token abc-123 " + server.url("/smoke")).exit_code, 0);
  EXPECT_THAT(server.request(), HasSubstr("\r\nAuthorization: Bearer abc-123\r\n"));
  EXPECT_EQ(place.run("info --json " + server.url("/smoke"), "BLOCKWALK_TOKEN=of-the-environment").exit_code, 0);
  EXPECT_THAT(server.request(), HasSubstr("\r\nAuthorization: Bearer of-the-environment\r\n"));
  EXPECT_EQ(place.run("render --token flag -o a.png " + server.url("/smoke"), "BLOCKWALK_TOKEN=variable").exit_code, 0);
  EXPECT_THAT(server.request(), HasSubstr("\r\nAuthorization: Bearer flag\r\n"));
  const Outcome split = place.run("info " + server.url("/smoke"), "BLOCKWALK_TOKEN='a b'");
  EXPECT_EQ(split.exit_code, 2);
  EXPECT_THAT(split.error, HasSubstr("BLOCKWALK_TOKEN: a token is"));
  const FixedServer closed(answerOf("401 Unauthorized", "", R"({"detail": "a token is needed"})"));
  const Outcome refused = place.run("info " + closed.url("/smoke"));
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.error, HasSubstr("401: a token is needed; give --token"));
}

TEST(Remote, HttpsIsBelievedOnlyWithItsCertificate) {
  const Workplace place;
  writeCertificate(place.path("here.pem"), "127.0.0.1");
  writeCertificate(place.path("elsewhere.pem"), "192.0.2.1");
  const std::string image("\x89PNG\0pixels", 11);
  const FixedServer server(answerOf("200 OK", "X-Blockwalk-Stats: {}\r\n", image),
                           {.certificate = place.path("here.pem")});
  const auto draw = [&](const FixedServer& from, const std::string& flags) {
    std::filesystem::remove(place.path("a.png"));
    return place.run("render " + from.url("/smoke") + " -o a.png " + flags);
  };
  const Outcome unknown = draw(server, "");
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_THAT(unknown.error, HasSubstr("certificate verify failed"));
  EXPECT_THAT(unknown.error, HasSubstr("--ca"));
  EXPECT_EQ(server.request(), "") << "nothing is asked of whom nobody knows";
  const Outcome known = draw(server, "--ca here.pem --token secret");
  EXPECT_EQ(known.exit_code, 0) << known.error;
  EXPECT_EQ(place.read("a.png"), image);
  EXPECT_THAT(server.request(), HasSubstr("Bearer secret"));
  EXPECT_EQ(draw(server, "--insecure").exit_code, 0);
  const FixedServer other(answerOf("200 OK", "", image), {.certificate = place.path("elsewhere.pem")});
  EXPECT_EQ(draw(other, "--ca elsewhere.pem").exit_code, 1) << "trusted, but for another address";
  EXPECT_EQ(other.request(), "");
  const FixedServer plain(answerOf("200 OK", "", image));
  const Outcome clear = place.run("info https://127.0.0.1:" + std::to_string(plain.port()) + "/smoke --insecure");
  EXPECT_EQ(clear.exit_code, 1) << "https is not spoken there";
}

TEST(Remote, AnAnswerIsNoLargerThanWhatWasAskedFor) {
  const Workplace place;
  const FixedServer server(answerOf("200 OK", "", std::string(std::size_t{5} << 20, ' ')));
  const Outcome volume = place.run("info " + server.url("/smoke"));
  EXPECT_EQ(volume.exit_code, 1);
  EXPECT_THAT(volume.error, HasSubstr("larger than the 4194304 bytes"));
  const Outcome image = place.run("render " + server.url("/smoke") + " -o a.png --size 8x8");
  EXPECT_EQ(image.exit_code, 1);
  EXPECT_THAT(image.error, HasSubstr("larger than"));
  EXPECT_FALSE(std::filesystem::exists(place.path("a.png")));
  EXPECT_EQ(place.run("render " + server.url("/smoke") + " -o a.png --size 1000x1000").exit_code, 0);
  const FixedServer deep(answerOf("200 OK", "", std::string(1000000, '[')));
  EXPECT_EQ(place.run("info --json " + deep.url("/smoke")).exit_code, 1);
}

TEST(Remote, AServersBlameIsNoFlagOfOurs) {
  const Workplace place;
  const FixedServer strict(
      answerOf("400 Bad Request", "", R"({"status": 400, "detail": "Host must be a name", "field": "Host"})"));
  const Outcome refused = place.run("render " + strict.url("/smoke") + " -o a.png");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.error, HasSubstr("400: Host must be a name"));
  EXPECT_THAT(refused.error, Not(HasSubstr("--Host")));
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
