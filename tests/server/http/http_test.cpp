// SPDX-License-Identifier: Apache-2.0
// What HTTP gives when nothing is wrong, and how it behaves when it is slow, full or ending.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "server/routes.h"
#include "tests/server/running_server.h"

namespace blockwalk {
namespace {

using nlohmann::json;
constexpr const char* kImage = "/api/v1/volumes/rock/image";

TEST(Http, ListsAndDescribesVolumes) {
  RunningServer server({.files = {sampleVolume("rock"), sampleVolume("smoke"), sampleVolume("rock")}});
  const json list = get(server.port(), "/api/v1/volumes").json();
  ASSERT_EQ(list["volumes"].size(), 3u);
  EXPECT_EQ(list["volumes"][0]["id"], "rock");
  EXPECT_EQ(list["volumes"][1]["id"], "smoke");
  EXPECT_EQ(list["volumes"][1]["type"], "f32");
  EXPECT_EQ(list["volumes"][2]["id"], "rock-2");
  EXPECT_EQ(list["volumes"][0]["state"], "ready");
  const json smoke = get(server.port(), "/api/v1/volumes/smoke").json();
  EXPECT_EQ(smoke["id"], "smoke");
  EXPECT_EQ(smoke["histogram"]["counts"].size(), 256u);
  EXPECT_TRUE(smoke["default_view"].contains("tf"));
  EXPECT_EQ(get(server.port(), "/api/v1/device").json()["name"], "fake");
  EXPECT_THAT(get(server.port(), "/metrics").body, testing::HasSubstr("blockwalk_requests_total"));
}

TEST(Http, GetAndPostGiveTheSameImage) {
  RunningServer server;
  const auto got = get(server.port(), std::string(kImage) + "?size=40x30&eye=5,1,2&range=10:200&walk=off");
  const auto posted = post(server.port(), kImage, R"({"size":[40,30],"eye":[5,1,2],"range":[10,200],"walk":false})");
  ASSERT_EQ(got.status, 200);
  ASSERT_EQ(posted.status, 200);
  EXPECT_EQ(got.fields.at("content-type"), "image/png");
  EXPECT_TRUE(got.body.starts_with("\x89PNG"));
  EXPECT_EQ(got.body, posted.body);
  EXPECT_EQ(got.fields.at("etag"), posted.fields.at("etag"));
  EXPECT_EQ(json::parse(got.fields.at("x-blockwalk-stats"))["rays"], 1200);
  const auto raw = get(server.port(), std::string(kImage) + "?size=40x30&format=raw");
  EXPECT_EQ(raw.body.size(), 4800u);
  EXPECT_EQ(json::parse(raw.fields.at("x-blockwalk-raw")),
            json::parse(R"({"width":40,"height":30,"channels":4,"type":"u8"})"));
  EXPECT_FALSE(got.fields.contains("x-blockwalk-raw"));
  EXPECT_EQ(get(server.port(), std::string(kImage) + "?size=4x3&format=jpeg").fields.at("content-type"), "image/jpeg");
  const auto webp = get(server.port(), std::string(kImage) + "?size=4x3&format=webp&quality=100");
  EXPECT_EQ(webp.fields.at("content-type"), "image/webp");
  EXPECT_TRUE(webp.body.starts_with("RIFF") && webp.body.substr(8, 4) == "WEBP");
  const auto bad = get(server.port(), std::string(kImage) + "?size=4x3&format=webp&quality=0");
  EXPECT_EQ(bad.status, 400);
  EXPECT_EQ(bad.json()["field"], "quality");
}

TEST(Http, AnImageThatIsKnownIsNotRenderedAgain) {
  RunningServer server;
  const std::string target = std::string(kImage) + "?size=8x8";
  const auto first = get(server.port(), target);
  const int rendered = server.control().started;
  const std::string tag = first.fields.at("etag");
  const auto again = get(server.port(), target, "If-None-Match: \"x\", " + tag + "\r\n");
  EXPECT_EQ(again.status, 304);
  EXPECT_EQ(again.fields.at("etag"), tag);
  EXPECT_EQ(again.body, "");
  EXPECT_EQ(server.control().started, rendered);
  // Another spelling of the same view is the same image; another view is not.
  EXPECT_EQ(get(server.port(), target + "&fov=4e1", "If-None-Match: " + tag + "\r\n").status, 304);
  EXPECT_EQ(get(server.port(), target + "&fov=41", "If-None-Match: " + tag + "\r\n").status, 200);
}

TEST(Http, TagsCompareWeaklyAndAreFoundInLists) {
  RunningServer server;
  const std::string target = std::string(kImage) + "?size=8x8";
  const std::string tag = get(server.port(), target).fields.at("etag");
  const auto status = [&](const std::string& fields) { return get(server.port(), target, fields).status; };
  EXPECT_EQ(status("If-None-Match: W/" + tag + "\r\n"), 304);
  EXPECT_EQ(status("If-None-Match: *\r\n"), 304);
  EXPECT_EQ(status("If-None-Match: \"a,b\" ,W/\"c\", W/" + tag + ", \"d\"\r\n"), 304);
  EXPECT_EQ(status("If-None-Match: \"a\"\r\nIf-None-Match: " + tag + "\r\n"), 304);
  const std::string bare = tag.substr(1, tag.size() - 2);
  EXPECT_EQ(status("If-None-Match: " + bare + "\r\n"), 200) << "a tag has quotes";
  EXPECT_EQ(status("If-None-Match: \"x, " + bare + ", y\"\r\n"), 200) << "inside another tag";
  EXPECT_EQ(status("If-None-Match: w/" + tag + "\r\n"), 200);
  EXPECT_EQ(status("If-None-Match: \"\r\n"), 200);
}

TEST(Http, HeadAndOptions) {
  RunningServer server;
  WireClient client(server.port());
  client.send("HEAD /api/v1/volumes HTTP/1.1\r\nHost: localhost\r\n\r\n");
  const auto head = client.readReply(false);
  EXPECT_EQ(head.status, 200);
  EXPECT_NE(head.fields.at("content-length"), "0");
  client.send(fmt::format("HEAD {} HTTP/1.1\r\nHost: localhost\r\n\r\n", kImage));
  EXPECT_TRUE(client.readReply(false).fields.contains("etag"));
  EXPECT_EQ(server.control().started, 0);
  client.send("OPTIONS * HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(client.readReply().status, 204);
  client.send(fmt::format("OPTIONS {} HTTP/1.1\r\nHost: localhost\r\n\r\n", kImage));
  EXPECT_EQ(client.readReply().fields.at("allow"), "GET, HEAD, POST, OPTIONS");
  client.send("GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(client.readReply().status, 200) << "the connection is still in step";
}

TEST(Http, AcceptIsReadWhole) {
  RunningServer server;
  const auto status = [&](const std::string& fields) { return get(server.port(), "/api/v1/volumes", fields).status; };
  EXPECT_EQ(status("Accept: text/html\r\nAccept: application/json\r\n"), 200) << "every line counts";
  EXPECT_EQ(status("Accept: text/html, */*;q=0.1\r\n"), 200);
  EXPECT_EQ(status("Accept: APPLICATION/JSON\r\n"), 200);
  EXPECT_EQ(status("Accept: application/json;q=0\r\n"), 406);
  EXPECT_EQ(status("Accept: application/json;q=0.000, */*\r\n"), 406) << "what names it more closely decides";
  EXPECT_EQ(status("Accept: application/json; Q = 0\r\n"), 200) << "no weight has spaces";
  EXPECT_EQ(status("Accept: application/json;q=0.001\r\n"), 200);
  EXPECT_EQ(status("Accept: application/json;version=q=0\r\n"), 200) << "a parameter of another name";
  EXPECT_EQ(status("Accept: application/json;a=\";q=0,\"\r\n"), 200) << "inside quotes";
  EXPECT_EQ(status("Accept: application/*\r\n"), 200);
  EXPECT_EQ(status("Accept: applicatio/*\r\n"), 406);
}

TEST(Http, EveryPathOfTheTableAnswersAndSaysItsMethods) {
  RunningServer server;
  for (const Path& path : interfacePaths()) {
    std::string target(path.path);
    if (const std::size_t id = target.find("{id}"); id != std::string::npos) target.replace(id, 4, "rock");
    const auto allowed = request(server.port(), fmt::format("OPTIONS {} HTTP/1.1\r\nHost: localhost\r\n\r\n", target));
    EXPECT_EQ(allowed.status, 204) << target;
    EXPECT_EQ(allowed.fields.at("allow"), path.methods) << target;
    const auto deleted = request(server.port(), fmt::format("DELETE {} HTTP/1.1\r\nHost: localhost\r\n\r\n", target));
    EXPECT_EQ(deleted.status, 405) << target;
    EXPECT_EQ(deleted.fields.at("allow"), path.methods) << target;
    if (target.ends_with("/pick")) target += "?x=0&y=0";
    if (target.ends_with("/slice")) target += "?axis=z&index=0";
    const int status = get(server.port(), target).status;
    const bool is_got = path.methods.find("GET") != std::string_view::npos;
    EXPECT_TRUE(is_got ? status == 200 || status == 426 : status == 405) << target << " " << status;
  }
  EXPECT_EQ(get(server.port(), "/api/v1/volumes/rock/nothing").status, 404);
  EXPECT_EQ(get(server.port(), "/livez").status, 200);
}

TEST(Http, AStreamHasNoHead) {
  RunningServer server;
  std::string upgrade = upgradeHead("rock");
  upgrade.replace(0, 3, "HEAD");
  const auto refused = request(server.port(), upgrade + "\r\n");
  EXPECT_EQ(refused.status, 405);
  EXPECT_EQ(refused.fields.at("allow"), "GET, OPTIONS");
}

TEST(Http, MetricsCountTimesAndMemory) {
  RunningServer server;
  get(server.port(), std::string(kImage) + "?size=8x8");
  const std::string metrics = get(server.port(), "/metrics").body;
  for (const char* line :
       {"# TYPE blockwalk_frame_render_seconds histogram\n", "blockwalk_frame_render_seconds_bucket{le=\"+Inf\"} 1\n",
        "blockwalk_frame_render_seconds_count 1\n", "blockwalk_frame_wait_seconds_bucket{le=\"10\"} 1\n",
        "blockwalk_frame_encode_seconds_count 1\n", "blockwalk_device_memory_used_bytes ",
        "blockwalk_pending_pixels "}) {
    EXPECT_THAT(metrics, testing::HasSubstr(line));
  }
}

TEST(Http, PipelinedRequestsAreAnsweredInOrder) {
  RunningServer server;
  WireClient client(server.port());
  std::string requests;
  constexpr int kCount = 300;
  for (int i = 1; i <= kCount; ++i) {
    requests += fmt::format("GET {}?size={}x1&format=raw HTTP/1.1\r\nHost: localhost\r\n\r\n", kImage, i);
  }
  client.send(requests);
  client.finishSending();
  for (int i = 1; i <= kCount; ++i) {
    const auto reply = client.readReply();
    ASSERT_EQ(reply.status, 200) << i;
    ASSERT_EQ(reply.body.size(), static_cast<std::size_t>(i) * 4);
  }
  EXPECT_TRUE(client.atEnd());
}

TEST(Http, ChunkedAndExpectedBodies) {
  RunningServer server;
  WireClient client(server.port());
  const std::string head =
      fmt::format("POST {} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n", kImage);
  client.send(head + "Transfer-Encoding: chunked\r\n\r\n9\r\n{\"size\":[\r\n5\r\n4,4]}\r\n0\r\n\r\n");
  EXPECT_EQ(client.readReply().status, 200);
  client.send(head + "Content-Length: 14\r\nExpect: 100-continue\r\n\r\n");
  EXPECT_EQ(client.readReply(false).status, 100);
  client.send(R"({"size":[4,4]})");
  EXPECT_EQ(client.readReply().status, 200);
}

TEST(Http, OldAndClosingConnectionsEnd) {
  RunningServer server;
  for (const char* text :
       {"GET /healthz HTTP/1.0\r\n\r\n", "GET /healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"}) {
    WireClient client(server.port());
    client.send(text);
    EXPECT_EQ(client.readReply().status, 200);
    EXPECT_TRUE(client.atEnd());
  }
}

TEST(Http, AHeaderMustArriveInTime) {
  ServerOptions options;
  options.header_time = 1;
  RunningServer server(options);
  const auto begin = std::chrono::steady_clock::now();
  WireClient silent(server.port());
  WireClient slow(server.port());
  std::thread dripping([&] {
    for (char c : std::string_view("GET /healthz HTTP")) {
      slow.send(std::string_view(&c, 1));
      std::this_thread::sleep_for(std::chrono::milliseconds(150));
    }
  });
  EXPECT_TRUE(silent.atEnd());
  EXPECT_TRUE(slow.atEnd());
  const auto took = std::chrono::steady_clock::now() - begin;
  EXPECT_LT(took, std::chrono::milliseconds(2400)) << "bytes that drip do not extend the time";
  dripping.join();
  EXPECT_EQ(get(server.port(), "/healthz").status, 200);
}

TEST(Http, ImagesBeyondTheQueueAreRefused) {
  ServerOptions options;
  options.max_image_jobs = 2;
  RunningServer server(options);
  server.control().band_ms = 300;
  std::vector<WireClient> clients;
  for (int i = 0; i < 2; ++i) {
    clients.emplace_back(server.port());
    clients.back().send(fmt::format("GET {}?size=4x4&fov={} HTTP/1.1\r\nHost: localhost\r\n\r\n", kImage, 30 + i));
  }
  EXPECT_TRUE(eventually([&] { return server.control().started > 0; }));
  EXPECT_TRUE(eventually(
      [&] { return get(server.port(), "/metrics").body.find("blockwalk_image_jobs 2") != std::string::npos; }));
  const auto third = get(server.port(), std::string(kImage) + "?size=4x4");
  EXPECT_EQ(third.status, 429);
  EXPECT_EQ(third.fields.at("retry-after"), "1");
  for (auto& client : clients) EXPECT_EQ(client.readReply().status, 200);
  EXPECT_EQ(get(server.port(), std::string(kImage) + "?size=4x4").status, 200);
}

TEST(Http, HugeImagesShareTheMemoryThatThereIs) {
  RunningServer server({.max_megapixels = 68});
  server.control().band_ms = 300;
  WireClient first(server.port());
  first.send(fmt::format("GET {}?size=8192x4096&format=jpeg HTTP/1.1\r\nHost: localhost\r\n\r\n", kImage));
  EXPECT_TRUE(eventually([&] { return server.control().started > 0; }));
  EXPECT_EQ(get(server.port(), std::string(kImage) + "?size=8192x8192").status, 429);
  EXPECT_EQ(first.readReply().status, 200);
}

TEST(Http, FailuresOfTheDeviceAreNotTheClients) {
  RunningServer server;
  server.control().fail_device = true;
  EXPECT_EQ(get(server.port(), std::string(kImage) + "?size=4x4").status, 503);
  server.control().fail_device = false;
  server.control().fail_memory = true;
  EXPECT_EQ(get(server.port(), std::string(kImage) + "?size=4x4").status, 503);
  server.control().fail_memory = false;
  EXPECT_EQ(get(server.port(), std::string(kImage) + "?size=4x4").status, 200);
}

TEST(Http, ReadinessFollowsTheVolumes) {
  RunningServer server({}, false);
  EXPECT_EQ(get(server.port(), "/healthz").status, 200);
  const auto loading = get(server.port(), "/readyz");
  EXPECT_EQ(loading.status, 503);
  EXPECT_EQ(loading.json()["volumes"]["rock"], "loading");
  const auto early = get(server.port(), std::string(kImage) + "?size=4x4");
  EXPECT_EQ(early.status, 503);
  EXPECT_TRUE(early.fields.contains("retry-after"));
  server.waitReady();
  EXPECT_EQ(get(server.port(), std::string(kImage) + "?size=4x4").status, 200);
}

TEST(Http, AFileThatFailsIsReportedAndTheRestServes) {
  const auto broken = scratchFolder() / "broken file.bwv";
  std::ofstream(broken) << "this is no volume";
  RunningServer server({.files = {broken, sampleVolume("rock")}});
  const json list = get(server.port(), "/api/v1/volumes").json();
  EXPECT_EQ(list["volumes"][0]["id"], "broken-file");
  EXPECT_EQ(list["volumes"][0]["state"], "failed");
  EXPECT_THAT(std::string(list["volumes"][0]["error"]),
              testing::AllOf(testing::HasSubstr("broken file.bwv"), testing::Not(testing::HasSubstr("/"))));
  EXPECT_EQ(list["volumes"][1]["state"], "ready");
  EXPECT_EQ(get(server.port(), "/api/v1/volumes/broken-file/image").status, 503);
  EXPECT_EQ(get(server.port(), std::string(kImage) + "?size=4x4").status, 200);
}

TEST(Http, ATokenIsAskedForWhereThereIsOne) {
  const auto token_file = scratchFolder() / "server-token";
  std::ofstream(token_file) << "0123456789abcdef\n";
  RunningServer server({.token_file = token_file});
  const auto refused = get(server.port(), "/api/v1/volumes");
  EXPECT_EQ(refused.status, 401);
  EXPECT_EQ(refused.fields.at("www-authenticate"), "Bearer");
  EXPECT_EQ(get(server.port(), "/api/v1/volumes", "Authorization: Bearer 0123456789abcdee\r\n").status, 401);
  EXPECT_EQ(get(server.port(), "/api/v1/volumes", "Authorization: Bearer 0123456789abcdef0\r\n").status, 401);
  EXPECT_EQ(get(server.port(), "/api/v1/volumes", "Authorization: Bearer 0123456789abcdef\r\n").status, 200);
  EXPECT_EQ(get(server.port(), "/?token=wrong").status, 401);
  const auto opened = get(server.port(), "/?token=0123456789abcdef");
  EXPECT_EQ(opened.status, 303);
  EXPECT_THAT(opened.fields.at("set-cookie"), testing::HasSubstr("HttpOnly; SameSite=Strict"));
  EXPECT_EQ(get(server.port(), "/api/v1/volumes", "Cookie: a=b; blockwalk_token=0123456789abcdef\r\n").status, 200);
  EXPECT_EQ(StreamClient(server.port(), "rock").reply().status, 401);
  std::string upgrade = upgradeHead("rock");
  upgrade.insert(upgrade.rfind("\r\n"), ", token.0123456789abcdef");
  EXPECT_EQ(request(server.port(), upgrade + "\r\n").status, 101);
  EXPECT_EQ(StreamClient(server.port(), "rock", "Authorization: Bearer 0123456789abcdef\r\n").reply().status, 101);
  EXPECT_EQ(get(server.port(), "/healthz").status, 200);
}

TEST(Http, AReloadTakesTheNewTokenAndABrokenOneLeavesTheOld) {
  const auto token_file = scratchFolder() / "changing-token";
  std::ofstream(token_file) << "0123456789abcdef\n";
  RunningServer server({.token_file = token_file});
  const auto knows = [&](const std::string& token) {
    return get(server.port(), "/api/v1/volumes", "Authorization: Bearer " + token + "\r\n").status == 200;
  };
  EXPECT_TRUE(knows("0123456789abcdef"));
  std::ofstream(token_file) << "fedcba9876543210\n";
  EXPECT_TRUE(knows("0123456789abcdef")) << "not before it is told";
  server.reload();
  EXPECT_TRUE(eventually([&] { return knows("fedcba9876543210"); }));
  EXPECT_FALSE(knows("0123456789abcdef"));
  std::ofstream(token_file) << "short";
  server.reload();
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_TRUE(knows("fedcba9876543210"));
  EXPECT_FALSE(knows("short"));
}

TEST(Http, DrainingEndsWhatRunsAndTakesNothingNew) {
  RunningServer server;
  server.control().band_ms = 400;
  WireClient running(server.port());
  WireClient open(server.port());
  open.send("GET /readyz HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(open.readReply().status, 200);
  running.send(fmt::format("GET {}?size=4x4 HTTP/1.1\r\nHost: localhost\r\n\r\n", kImage));
  EXPECT_TRUE(eventually([&] { return server.control().started > 0; }));
  server.drain();
  open.send("GET /readyz HTTP/1.1\r\nHost: localhost\r\n\r\n");
  const auto draining = open.readReply();
  EXPECT_EQ(draining.status, 503);
  EXPECT_EQ(draining.json()["draining"], true);
  EXPECT_EQ(running.readReply().status, 200);
  EXPECT_EQ(server.join(), 0);
}

}  // namespace
}  // namespace blockwalk
