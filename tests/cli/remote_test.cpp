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

TEST(Remote, AnimateSendsTheViewsAndKeepsTheFile) {
  const Workplace place;
  const std::string zip("PK\3\4 and \0 more", 14);
  const FixedServer server(answerOf("200 OK", "X-Blockwalk-Animation: {\"frames\": 3, \"fps\": 2.5}\r\n", zip));
  const Outcome turn = place.run("animate '" + server.url("/#volume=smoke&mode=mip&fov=30") +
                                 "' -o a.zip --size 4x3 --fps 2.5 --seconds 1.2 --ortho 9");
  ASSERT_EQ(turn.exit_code, 0) << turn.error;
  EXPECT_EQ(place.read("a.zip"), zip);
  EXPECT_EQ(turn.out, "a.zip: 3 frames, 2.5 a second\n");
  EXPECT_THAT(server.request(), StartsWith("POST /api/v1/volumes/smoke/animate HTTP/1.1\r\n"));
  EXPECT_EQ(nlohmann::json::parse(server.request().substr(server.request().find("\r\n\r\n") + 4)),
            nlohmann::json::parse(R"({"format": "zip", "fps": 2.5, "turntable": {"degrees": 360.0, "seconds": 1.2},
                                      "view": {"mode": "mip", "ortho": "9", "size": "4x3"}})"));
  EXPECT_EQ(place.run("animate " + server.url("/smoke") + " -o folder").exit_code, 2);
  const FixedServer refusing(answerOf("429 Too Many Requests", "Content-Type: application/problem+json\r\n",
                                      R"({"detail": "as many animations are made as may"})"));
  const Outcome refused = place.run("animate " + refusing.url("/smoke") + " -o b.webp");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.error, HasSubstr("as many animations are made as may"));
  EXPECT_FALSE(std::filesystem::exists(place.path("b.webp")));
  EXPECT_FALSE(std::filesystem::exists(place.path("b.webp.partial")));
}

// Chunks without a last one: the server ended it.
TEST(Remote, AnAnimationThatBreaksOffLeavesNothing) {
  const Workplace place;
  const FixedServer server("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n4\r\nPK\3\4\r\n");
  const Outcome outcome = place.run("animate " + server.url("/smoke") + " -o a.zip");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_FALSE(std::filesystem::exists(place.path("a.zip")));
  EXPECT_FALSE(std::filesystem::exists(place.path("a.zip.partial")));
}

TEST(Remote, RenderSaysWhyThePictureIsEmpty) {
  const Workplace place;
  const FixedServer empty(
      answerOf("200 OK",
               "X-Blockwalk-Stats: {\"drawn_pixels\": 0, \"reasons\": [{\"reason\": \"tf\", \"detail\": \"It is "
               "clear\\u001b.\", \"change\": {\"tf\": \"auto\", \"fov\": 40}}]}\r\n",
               "image"));
  const Outcome outcome = place.run("render " + empty.url("/smoke") + " -o a.png");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.error, "blockwalk: the picture is empty (tf): It is clear?. Try --fov 40 --tf auto\n");
  const FixedServer other(
      answerOf("200 OK", "X-Blockwalk-Stats: {\"drawn_pixels\": 0, \"reasons\": [7]}\r\n", "image"));
  EXPECT_EQ(place.run("render " + other.url("/smoke") + " -o a.png").error, "blockwalk: the picture is empty\n");
}

TEST(Remote, RenderTakesTheAddressOfThePage) {
  const Workplace place;
  const FixedServer server(answerOf("200 OK", "X-Blockwalk-Stats: {}\r\n", "image"));
  const std::string page = server.url("/#volume=my%20smoke&eye=1,2,3&range=1:2&tf=1:000000:0,2:ff0000:1&fov=30&lod=4");
  ASSERT_EQ(place.run("render '" + page + "' -o a.png --size 4x3").exit_code, 0);
  EXPECT_THAT(server.request(), StartsWith("GET /api/v1/volumes/my%20smoke/image?"));
  for (const char* member : {"size=4x3", "eye=1,2,3", "range=1:2", "tf=1:000000:0,2:ff0000:1", "fov=30", "lod=4"}) {
    EXPECT_THAT(server.request(), HasSubstr(member));
  }
  ASSERT_EQ(place.run("render '" + page + "' -o a.png --range 5:6 --ortho 7").exit_code, 0);
  EXPECT_THAT(server.request(), HasSubstr("range=5:6")) << "a flag goes before the address";
  EXPECT_THAT(server.request(), HasSubstr("ortho=7"));
  EXPECT_THAT(server.request(), Not(HasSubstr("fov")));
  EXPECT_EQ(place.run("info --json '" + server.url("/#volume=smoke&eye=1,2,3") + "'").exit_code, 1) << "no JSON";
  EXPECT_THAT(server.request(), StartsWith("GET /api/v1/volumes/smoke HTTP/1.1\r\n"));
  const Outcome beside = place.run("render '" + server.url("/#volume=smoke&slices=on&marks=x&fov=30") + "' -o a.png");
  EXPECT_EQ(beside.exit_code, 0);
  EXPECT_THAT(beside.error, HasSubstr("only the page has these, they are not drawn: slices, marks\n"));
  EXPECT_THAT(server.request(), Not(HasSubstr("slices")));
  const Outcome unknown = place.run("render '" + server.url("/#volume=smoke&colour=red") + "' -o a.png");
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.error, HasSubstr("colour"));
  for (const char* fragment : {"/#", "/#eye=1,2,3", "/#volume=", "/#volume=a&eye", "/#volume=a%2", "/#volume=a/b"}) {
    EXPECT_EQ(place.run("render '" + server.url(fragment) + "' -o a.png").exit_code, 2) << fragment;
  }
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
