// SPDX-License-Identifier: Apache-2.0
// Voxels by HTTP: the bytes of an export, for several clients at once, with bounds.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <memory>

#include "tests/server/log_capture.h"
#include "tests/server/running_server.h"
#include "tests/volume/memory_source.h"
#include "volume/export/export.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;
constexpr const char* kRegion = "/api/v1/volumes/rock/region";

std::string bytesOf(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::string exported(const std::filesystem::path& volume, const ExportOptions& options) {
  const auto path = scratchFolder() / "exported";
  exportVolume(VolumeFile(volume), path, options);
  return bytesOf(path);
}

TEST(Region, IsWhatAnExportIs) {
  const auto smoke = sampleVolume("smoke", 96);
  RunningServer server({.files = {sampleVolume("rock"), smoke}});
  const auto whole = get(server.port(), kRegion);
  EXPECT_EQ(whole.status, 200);
  EXPECT_EQ(whole.fields.at("content-type"), "application/x-nrrd");
  EXPECT_EQ(whole.fields.at("content-disposition"), "attachment; filename=\"rock.nrrd\"");
  EXPECT_TRUE(whole.body == exported(sampleVolume("rock"), {}));
  const auto box = get(server.port(), "/api/v1/volumes/smoke/region?format=npy&level=1&box=1,2,3,9,12,11");
  EXPECT_EQ(box.status, 200);
  EXPECT_TRUE(box.body ==
              exported(smoke, {.format = ExportFormat::npy, .level = 1, .box = VoxelBox{{1, 2, 3}, {9, 12, 11}}}));
  const auto raw = get(server.port(), std::string(kRegion) + "?format=raw&box=0,0,0,2,3,4");
  EXPECT_EQ(raw.body.size(), 2u * 3 * 4 * 4);
  EXPECT_EQ(nlohmann::json::parse(raw.fields.at("x-blockwalk-raw")),
            nlohmann::json::parse(R"({"dims":[2,3,4],"channels":1,"type":"rgba8"})"));
}

// Steps in time: a region is of one, and so is an image.
TEST(Region, IsOfOneStep) {
  const auto path = twoSteps("film", [](unsigned step) {
    return volume_test::randomSource(VoxelType::u8, {40, 30, 20}, 1 + step);
  });
  RunningServer server({.files = {path}});
  EXPECT_EQ(get(server.port(), "/api/v1/volumes/film").json()["steps"], 2);
  const std::string region = "/api/v1/volumes/film/region?format=raw";
  const auto first = get(server.port(), region + "&time=0");
  const auto second = get(server.port(), region + "&time=1");
  EXPECT_TRUE(first.body == get(server.port(), region).body);
  EXPECT_FALSE(second.body == first.body);
  EXPECT_NE(second.fields.at("etag"), first.fields.at("etag"));
  exportVolume(VolumeFile(path).atStep(1), scratchFolder() / "exported", {.format = ExportFormat::raw});
  EXPECT_TRUE(second.body == bytesOf(scratchFolder() / "exported"));
  const auto none = get(server.port(), region + "&time=2");
  EXPECT_EQ(none.status, 400);
  EXPECT_EQ(none.json()["field"], "time");
  EXPECT_EQ(get(server.port(), "/api/v1/volumes/film/image?size=9x9&time=1").status, 200);
  const auto image = get(server.port(), "/api/v1/volumes/film/image?time=2");
  EXPECT_EQ(image.status, 400);
  EXPECT_EQ(image.json()["field"], "time");
}

TEST(Region, IsNotSentAgainToWhoHasIt) {
  RunningServer server;
  const auto first = get(server.port(), kRegion);
  const std::string etag = first.fields.at("etag");
  EXPECT_EQ(get(server.port(), kRegion, "If-None-Match: " + etag + "\r\n").status, 304);
  EXPECT_NE(get(server.port(), std::string(kRegion) + "?format=npy").fields.at("etag"), etag);
  WireClient client(server.port());
  client.send("HEAD /api/v1/volumes/rock/region HTTP/1.1\r\nHost: localhost\r\n\r\n");
  const auto head = client.readReply(false);
  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.fields.at("content-length"), std::to_string(first.body.size()));
  // The connection goes on.
  client.send("GET /api/v1/volumes/rock/region HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_TRUE(client.readReply().body == first.body);
  client.send("GET /api/v1/volumes/rock HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(client.readReply().status, 200);
}

TEST(Region, RefusesWhatTheVolumeHasNot) {
  RunningServer server({.max_region = 1000});
  const auto fault = [&](const std::string& query) {
    const auto reply = get(server.port(), kRegion + query);
    return fmt::format("{} {} {}", reply.status, reply.json().value("field", ""),
                       reply.json()["detail"].get<std::string>());
  };
  EXPECT_THAT(fault("?level=9"), HasSubstr("400 level rock: level: 9 is outside 0.."));
  EXPECT_THAT(fault("?box=0,0,0,1,1,500"), HasSubstr("400 box rock: box: 0..500 along axis 2"));
  EXPECT_THAT(fault("?channels=1"), HasSubstr("400 channels rock: channels: 1 is outside 0..0"));
  EXPECT_THAT(fault("?size=1x1"), HasSubstr("400 size size: is no member of a region"));
  EXPECT_THAT(fault(""), HasSubstr("413 box the region has"));
  EXPECT_EQ(get(server.port(), std::string(kRegion) + "?box=0,0,0,5,5,10&format=raw").body.size(), 1000u);
  EXPECT_EQ(get(server.port(), "/api/v1/volumes/none/region").status, 404);
  EXPECT_EQ(post(server.port(), kRegion, "{}").status, 405);
  EXPECT_EQ(get(server.port(), kRegion, "Accept: image/png\r\n").status, 413) << "the bound comes first";
  EXPECT_EQ(get(server.port(), std::string(kRegion) + "?box=0,0,0,1,1,1", "Accept: image/png\r\n").status, 406);
}

// Replies that nobody reads hold their places, not those of pictures, and give them back.
TEST(Region, HasPlacesForSeveralOfAPeer) {
  const auto volume = sampleVolume("rock", 160);  // 16 MB: more than the kernel takes for who does not read
  RunningServer server({.files = {volume}});
  const std::string path = fmt::format("/api/v1/volumes/{}/region", volume.stem().string());
  const std::string line = fmt::format("GET {} HTTP/1.1\r\nHost: localhost\r\n\r\n", path);
  std::vector<WireClient> clients;
  for (int i = 0; i < 4; ++i) {
    clients.emplace_back(server.port());
    clients.back().send(line);
    EXPECT_TRUE(eventually([&] { return clients.back().hasBytes(); }));
  }
  const auto refused = get(server.port(), path);
  EXPECT_EQ(refused.status, 429);
  EXPECT_TRUE(refused.fields.contains("retry-after"));
  EXPECT_EQ(get(server.port(), fmt::format("/api/v1/volumes/{}/image?size=8x8", volume.stem().string())).status, 200);
  clients.pop_back();
  EXPECT_TRUE(eventually([&] { return get(server.port(), path + "?box=0,0,0,1,1,1").status == 200; }));
  for (WireClient& client : clients) EXPECT_EQ(client.readReply().status, 200);
}

TEST(Region, OfAFileThatWasReplacedOrBreaksSaysSo) {
  const auto path = scratchFolder() / "region.bwv";
  std::filesystem::copy_file(sampleVolume("rock"), path, std::filesystem::copy_options::overwrite_existing);
  LogCapture log;
  auto server = std::make_unique<RunningServer>(ServerOptions{.files = {path}});
  const std::string target = "/api/v1/volumes/region/region";
  const std::string whole = bytesOf(path);
  ASSERT_EQ(get(server->port(), target).status, 200);
  // Other voxels in the same file: a checksum fails, after the reply has begun.
  std::string changed = whole;
  changed[changed.size() - 100] ^= 1;
  const auto when = std::filesystem::last_write_time(path);
  {
    std::fstream stream(path, std::ios::binary | std::ios::in | std::ios::out);
    stream.write(changed.data(), static_cast<std::streamsize>(changed.size()));
  }
  std::filesystem::last_write_time(path, when);
  WireClient client(server->port());
  client.send("GET " + target + " HTTP/1.1\r\nHost: localhost\r\n\r\n");
  client.finishSending();
  const auto cut = client.readReply();
  EXPECT_EQ(cut.body, "(cut short)") << "the connection ends before the length that was said";
  // Gone.
  std::filesystem::remove(path);
  const auto gone = get(server->port(), target);
  EXPECT_EQ(gone.status, 503);
  EXPECT_THAT(gone.json()["detail"].get<std::string>(), HasSubstr("region: the file is gone"));
  server.reset();
  EXPECT_EQ(log.count("a region ends early"), 1);
}

}  // namespace
}  // namespace blockwalk
