// SPDX-License-Identifier: Apache-2.0
// Why a picture is empty, and what a pixel shows, by HTTP.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "tests/server/running_server.h"
#include "tests/volume/memory_source.h"
#include "volume/file/file.h"

namespace blockwalk {
namespace {

using nlohmann::json;

constexpr const char* kPick = "/api/v1/volumes/rock/pick";
constexpr const char* kExplain = "/api/v1/volumes/rock/explain";

json answered(RunningServer& server, const std::string& target) {
  const auto reply = get(server.port(), target);
  EXPECT_EQ(reply.status, 200) << target << ' ' << reply.body;
  EXPECT_EQ(reply.fields.at("cache-control"), "no-store");
  EXPECT_EQ(reply.fields.count("etag"), 0u);
  return reply.json();
}

std::vector<std::string> reasonsIn(const json& explained) {
  std::vector<std::string> names;
  for (const json& reason : explained["reasons"]) names.push_back(reason["reason"]);
  return names;
}

void expectRefused(RunningServer& server, const std::string& target, const char* field) {
  const auto reply = get(server.port(), target);
  EXPECT_EQ(reply.status, 400) << target;
  EXPECT_EQ(reply.json()["field"], field) << target << ' ' << reply.body;
}

// Over the real renderer, which knows what is to be seen.
class Questions : public testing::Test {
 protected:
  static RunningServer serverOf(std::vector<std::filesystem::path> files) {
    ServerOptions options;
    options.files = std::move(files);
    return RunningServer(options, true, [] { return createRenderer({}); });
  }
};

TEST_F(Questions, WhyAPictureIsEmpty) {
  RunningServer server = serverOf({sampleVolume("rock"), sampleVolume("smoke")});
  const json shown = answered(server, kExplain);
  EXPECT_EQ(shown["empty"], false);
  EXPECT_EQ(shown["complete"], true);
  EXPECT_EQ(shown["level"], 0);
  EXPECT_TRUE(shown["reasons"].empty());
  const std::string rock = std::string(kExplain) + "?size=400x300&";
  const std::string smoke = "/api/v1/volumes/smoke/explain?size=64x48&";
  for (const auto& [target, reason] : {std::pair{rock + "eye=0,0,900&target=0,0,1000", "camera"},
                                       {rock + "eye=1e9,0,0", "camera"},
                                       {rock + "range=300:400", "range"},
                                       {rock + "extinction=0", "extinction"},
                                       {rock + "mode=iso&iso=300", "iso"},
                                       {rock + "clip=-9,-9,-9,-8,-8,-8", "clip"},
                                       {rock + "planes=1,0,0,-900", "clip"},
                                       {smoke + "tf=0:000000:0", "tf"}}) {
    const json explained = answered(server, target);
    EXPECT_EQ(explained["empty"], true) << target;
    EXPECT_THAT(reasonsIn(explained), testing::ElementsAre(reason)) << target;
    // Whoever changes what is said sees something.
    std::string mended = target;
    for (const auto& [member, value] : explained["reasons"][0]["change"].items()) {
      const std::size_t at = mended.find(member + "=");
      if (at != std::string::npos) mended.erase(at, mended.find('&', at) - at);
      mended += "&" + member + "=" + (value.is_string() ? value.get<std::string>() : value.dump());
    }
    for (std::size_t at; (at = mended.find("&&")) != std::string::npos;) mended.erase(at, 1);
    if (const std::size_t at = mended.find("?&"); at != std::string::npos) mended.erase(at + 1, 1);
    EXPECT_EQ(answered(server, mended)["empty"], false) << mended;
  }
  expectRefused(server, rock + "fov=0", "fov");
  expectRefused(server, rock + "x=1", "x");
  expectRefused(server, rock + "output=depth&mode=mean", "output");
}

// The picture's own frame says so too.
TEST_F(Questions, AnEmptyPictureSaysWhy) {
  RunningServer server = serverOf({sampleVolume("rock")});
  const auto statsOf = [&](const std::string& query) {
    const auto reply = get(server.port(), "/api/v1/volumes/rock/image?size=40x30&" + query);
    EXPECT_EQ(reply.status, 200);
    return json::parse(reply.fields.at("x-blockwalk-stats"));
  };
  for (const char* background : {"000000", "102030", "10203040", "00000000"}) {
    const std::string over = std::string("background=") + background;
    const json empty = statsOf(over + "&range=300:400");
    EXPECT_EQ(empty["drawn_pixels"], 0);
    EXPECT_EQ(empty["reasons"][0]["reason"], "range");
    EXPECT_EQ(statsOf(over + "&eye=0,0,900&target=0,0,1000")["drawn_pixels"], 0) << "by a kernel";
    const json shown = statsOf(over);
    EXPECT_GT(shown["drawn_pixels"], 100);
    EXPECT_LT(shown["drawn_pixels"], 1200);
    EXPECT_FALSE(shown.contains("reasons"));
  }
  StreamClient client(server.port(), "rock");
  client.sendText(R"({"type":"view","id":1,"size":[40,30],"samples":4,"extinction":0})");
  json frame;
  do {
    frame = client.readFrame();
    EXPECT_EQ(frame["drawn_pixels"], 0);
    EXPECT_EQ(frame["reasons"][0]["reason"], "extinction");
    EXPECT_EQ(frame["reasons"][0]["change"], json::parse(R"({"extinction":0.2})"));
  } while (frame["final"] == false);
  EXPECT_EQ(client.readText("stats")["stats"]["reasons"][0]["reason"], "extinction");
  client.sendText(R"({"type":"view","id":2,"extinction":0.5})");
  do frame = client.readFrame();
  while (frame["id"] == 1);
  EXPECT_GT(frame["drawn_pixels"], 20);  // at a scale
  EXPECT_FALSE(frame.contains("reasons"));
}

// Against the picture of positions, and the values against the file.
TEST_F(Questions, APixelShowsWhatThePictureOfPositionsHas) {
  const auto smoke = sampleVolume("smoke", 96);
  RunningServer server = serverOf({sampleVolume("rock"), smoke});
  const VolumeFile file(smoke);
  std::size_t hits = 0;
  std::size_t misses = 0;
  for (const std::string view : {"volumes/rock/|mode=first-hit", "volumes/rock/|mode=blend&extinction=2",
                                 "volumes/rock/|mode=iso&filter=linear", "volumes/rock/|mode=mip",
                                 "volumes/smoke/|mode=blend&filter=linear&ortho=120", "volumes/smoke/|mode=mip&level=1",
                                 "volumes/smoke/|mode=first-hit&ortho=150", "volumes/smoke/|mode=iso&lod=1"}) {
    const std::size_t bar = view.find('|');
    const std::string path = "/api/v1/" + view.substr(0, bar);
    const std::string query = "?size=61x47&" + view.substr(bar + 1);
    const auto whole = get(server.port(), fmt::format("{}image{}&output=position&format=raw", path, query));
    ASSERT_EQ(whole.status, 200) << whole.body;
    std::vector<float> positions(61 * 47 * 3);
    ASSERT_EQ(whole.body.size(), positions.size() * sizeof(float));
    std::memcpy(positions.data(), whole.body.data(), whole.body.size());
    for (int i = 0; i < 24; ++i) {
      const int x = 14 + (i * 37 + 5) % 33;
      const int y = 9 + (i * 17 + 11) % 29;
      const json pick = answered(server, fmt::format("{}pick{}&x={}&y={}", path, query, x, y));
      const float* position = &positions[3 * static_cast<std::size_t>(y * 61 + x)];
      ASSERT_EQ(pick["hit"], !std::isnan(position[0])) << view << ' ' << x << ' ' << y;
      if (pick["hit"] == false) {
        EXPECT_EQ(pick.size(), 1u);
        ++misses;
        continue;
      }
      ++hits;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(static_cast<float>(pick["world"][axis].get<double>()), position[axis]) << view;
      }
      EXPECT_GT(pick["t"], 0);
      const json& voxel = pick["voxel"];
      const std::string box =
          fmt::format("{},{},{},{},{},{}", voxel[0].get<int>(), voxel[1].get<int>(), voxel[2].get<int>(),
                      voxel[0].get<int>() + 1, voxel[1].get<int>() + 1, voxel[2].get<int>() + 1);
      const std::string bytes = get(server.port(), fmt::format("{}region?format=raw&box={}", path, box)).body;
      ASSERT_EQ(bytes.size(), 4u);
      ASSERT_EQ(pick["values"].size(), 1u);
      if (path.find("rock") != std::string::npos) {
        const auto density = static_cast<unsigned char>(bytes[3]);
        EXPECT_EQ(pick["values"][0], density == 0 ? json() : json(density));
        if (view.find("first-hit") != std::string::npos) {
          EXPECT_FALSE(pick["values"][0].is_null()) << x << ' ' << y;
        }
      } else {
        float value = 0;
        std::memcpy(&value, bytes.data(), sizeof value);
        const ChannelInfo& channel = file.info().channels[0];
        const bool is_empty = channel.storedFromData(static_cast<double>(value)) <= channel.empty_threshold;
        EXPECT_EQ(pick["values"][0].is_null(), is_empty) << value;
        if (!is_empty) {
          EXPECT_EQ(pick["values"][0].get<double>(), static_cast<double>(value));
        }
      }
    }
  }
  EXPECT_GT(hits, 50u);
  EXPECT_GT(misses, 10u);
}

TEST_F(Questions, APixelIsOfOneStep) {
  const auto path = twoSteps("picked", [](unsigned step) {
    return volume_test::randomSource(VoxelType::u8, {40, 30, 20}, 5 + step);
  });
  RunningServer server = serverOf({path});
  const std::string pick = "/api/v1/volumes/picked/pick?size=9x9&mode=first-hit&tf=0:ffffff:1";
  for (int step = 0; step < 2; ++step) {
    json picked;
    for (int i = 0; i < 81 && (i == 0 || picked["hit"] == false); ++i) {
      picked = answered(server, fmt::format("{}&x={}&y={}&time={}", pick, i % 9, i / 9, step));
    }
    ASSERT_EQ(picked["hit"], true);
    const json& voxel = picked["voxel"];
    const std::string box =
        fmt::format("{},{},{},{},{},{}", voxel[0].get<int>(), voxel[1].get<int>(), voxel[2].get<int>(),
                    voxel[0].get<int>() + 1, voxel[1].get<int>() + 1, voxel[2].get<int>() + 1);
    const auto byte =
        get(server.port(), fmt::format("/api/v1/volumes/picked/region?format=raw&time={}&box={}", step, box)).body;
    EXPECT_EQ(picked["values"][0], static_cast<unsigned char>(byte.at(0)));
  }
  EXPECT_EQ(get(server.port(), pick + "&x=0&y=0&time=2").json()["field"], "time");
}

TEST(QuestionsAsked, WhatIsNoPixelIsRefusedByName) {
  RunningServer server;
  const std::string pick = std::string(kPick) + "?size=20x10";
  expectRefused(server, pick, "x");
  expectRefused(server, pick + "&x=1", "y");
  expectRefused(server, pick + "&x=20&y=1", "x");
  expectRefused(server, pick + "&x=1&y=10", "y");
  expectRefused(server, pick + "&x=-1&y=1", "x");
  expectRefused(server, pick + "&x=1.5&y=1", "x");
  expectRefused(server, pick + "&x=nan&y=1", "x");
  expectRefused(server, pick + "&x=&y=1", "x");
  expectRefused(server, pick + "&x=99999999999999999999&y=1", "x");
  expectRefused(server, pick + "&x=1&y=1&x=1", "x");
  expectRefused(server, pick + "&x=1&y=1&z=1", "z");
  expectRefused(server, pick + "&x=1&y=1&mode=mean", "output");
  expectRefused(server, pick + "&x=1&y=1&mode=blocks", "output");
  EXPECT_EQ(get(server.port(), "/api/v1/volumes/none/pick?x=1&y=1").status, 404);
  EXPECT_EQ(request(server.port(),
                    fmt::format("POST {}&x=1&y=1 HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n", pick))
                .status,
            405);
  EXPECT_EQ(get(server.port(), pick + "&x=1&y=1").json(), json::parse(R"({"hit":false})"));
  WireClient client(server.port());
  client.send(fmt::format("HEAD {}&x=1&y=1 HTTP/1.1\r\nHost: localhost\r\n\r\n", pick));
  EXPECT_EQ(client.readReply(false).status, 200);
}

TEST(QuestionsAsked, CountAsImages) {
  ServerOptions options;
  options.max_image_jobs = 2;
  RunningServer server(options);
  server.control().band_ms = 300;
  std::vector<WireClient> clients;
  for (const char* target : {kPick, kExplain}) {
    clients.emplace_back(server.port());
    clients.back().send(fmt::format("GET {}?size=4x4{} HTTP/1.1\r\nHost: localhost\r\n\r\n", target,
                                    target == kPick ? "&x=0&y=0" : ""));
  }
  EXPECT_TRUE(eventually(
      [&] { return get(server.port(), "/metrics").body.find("blockwalk_image_jobs 2") != std::string::npos; }));
  EXPECT_EQ(get(server.port(), std::string(kExplain) + "?size=4x4").status, 429);
  EXPECT_EQ(get(server.port(), std::string(kPick) + "?x=0&y=0").status, 429);
  for (auto& client : clients) EXPECT_EQ(client.readReply().status, 200);
}

TEST(QuestionsAsked, OfWhoLeavesIsNotDrawn) {
  RunningServer server;
  server.control().bands = 500;
  server.control().band_ms = 10;
  for (const char* target : {kPick, kExplain}) {
    const int cancelled = server.control().cancelled;
    const int started = server.control().started;
    {
      WireClient client(server.port());
      client.send(
          fmt::format("GET {}{} HTTP/1.1\r\nHost: localhost\r\n\r\n", target, target == kPick ? "?x=0&y=0" : ""));
      EXPECT_TRUE(eventually([&] { return server.control().started > started; }));
    }
    EXPECT_TRUE(eventually([&] { return server.control().cancelled > cancelled; }));
  }
}

}  // namespace
}  // namespace blockwalk
