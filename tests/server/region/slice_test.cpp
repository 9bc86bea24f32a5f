// SPDX-License-Identifier: Apache-2.0
// Planes by HTTP: what the file holds, for several clients at once, with bounds.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <span>
#include <thread>

#include "protocol/query_string.h"
#include "protocol/slice_picture.h"
#include "tests/server/running_server.h"
#include "tests/volume/memory_source.h"
#include "volume/slice/slice_reader.h"

namespace blockwalk {
namespace {

using testing::HasSubstr;

std::string sliceOf(std::string_view volume, std::string_view query) {
  return fmt::format("/api/v1/volumes/{}/slice?{}", volume, query);
}

// By the same rooms, without a server.
std::string madeSlice(const std::filesystem::path& path, std::string_view query) {
  const SliceRequest request = readSliceRequest(parseQueryString(query));
  const VolumeFile all(path);
  const VolumeFile file = all.atStep(request.time);
  const ResolvedSlice slice = resolveSlice(request, file.info());
  const auto reader = makeSliceReader(file, slice.plan);
  while (reader->step()) continue;
  const std::vector<std::byte> bytes = encodeSlice(file, slice, reader->take());
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST(Slice, HasTheValuesOfARegion) {
  const auto smoke = sampleVolume("smoke", 96);
  RunningServer server({.files = {sampleVolume("rock"), smoke}});
  for (const auto& path : {sampleVolume("rock"), smoke}) {
    const glm::ivec3 dims = VolumeFile(path).info().dims;
    const std::string volume = path.stem().string();
    const std::string region = fmt::format("/api/v1/volumes/{}/region?format=raw&box=", volume);
    const auto z = get(server.port(), sliceOf(volume, "axis=z&index=11&format=raw"));
    ASSERT_EQ(z.status, 200);
    EXPECT_EQ(z.body.size(), static_cast<std::size_t>(4 * dims.x * dims.y));
    EXPECT_TRUE(z.body == get(server.port(), region + fmt::format("0,0,11,{},{},12", dims.x, dims.y)).body);
    const auto y = get(server.port(), sliceOf(volume, "axis=y&index=20&format=raw"));
    EXPECT_EQ(y.body.size(), static_cast<std::size_t>(4 * dims.x * dims.z));
    EXPECT_TRUE(y.body == get(server.port(), region + fmt::format("0,20,0,{},21,{}", dims.x, dims.z)).body);
    const auto x = get(server.port(), sliceOf(volume, "axis=x&index=30&format=raw&box=0,3,5,1,30,31"));
    EXPECT_EQ(x.body.size(), 4u * 27 * 26);
    EXPECT_TRUE(x.body == get(server.port(), region + "30,3,5,31,30,31").body);
  }
  const glm::ivec3 dims = VolumeFile(smoke).info().levels[1].dims;
  const auto coarse = get(server.port(), sliceOf("smoke", "axis=z&index=22&level=1&format=raw"));
  const std::string box = fmt::format("0,0,11,{},{},12", dims.x, dims.y);
  EXPECT_TRUE(coarse.body == get(server.port(), "/api/v1/volumes/smoke/region?format=raw&level=1&box=" + box).body);
}

TEST(Slice, IsAPictureOrAFile) {
  const auto smoke = sampleVolume("smoke", 96);
  RunningServer server({.files = {smoke}});
  for (const auto& [query, type] :
       {std::pair{"axis=z&index=30", "image/png"},
        {"axis=y&index=30&thickness=9&reduce=mean&format=webp", "image/webp"},
        {"axis=x&index=40&format=npy", "application/octet-stream"},
        {"axis=x&index=40&format=nrrd", "application/x-nrrd"},
        {"centre=48,48,48&right=1,1,0&down=0,0,1&pixel=0.9&size=70x60&thickness=4&filter=linear", "image/png"},
        {"centre=48,48,48&right=1,1,0&down=0,0,1&pixel=0.9&size=70x60&format=nrrd", "application/x-nrrd"}}) {
    const auto reply = get(server.port(), sliceOf("smoke", query));
    ASSERT_EQ(reply.status, 200) << query << reply.body;
    EXPECT_EQ(reply.fields.at("content-type"), type);
    EXPECT_EQ(reply.fields.at("cache-control"), "no-cache");
    EXPECT_TRUE(reply.body == madeSlice(smoke, query)) << query;
    EXPECT_EQ(reply.fields.contains("content-disposition"), std::string_view(type).starts_with("application/"));
  }
  const auto npy = get(server.port(), sliceOf("smoke", "axis=x&index=40&format=npy&box=0,0,0,1,7,5"));
  EXPECT_THAT(npy.body, HasSubstr("'shape': (5, 7), "));
  const auto nrrd = get(server.port(), sliceOf("smoke", "axis=y&index=30&format=nrrd&thickness=3"));
  EXPECT_THAT(nrrd.body, HasSubstr("sizes: 60 1 60\n"));
}

TEST(Slice, SaysWhatItIs) {
  RunningServer server({.files = {sampleVolume("smoke", 96)}});
  const auto reply = get(server.port(), sliceOf("smoke", "axis=y&index=31&level=1&window=0:1"));
  const auto said = nlohmann::json::parse(reply.fields.at("x-blockwalk-slice"));
  EXPECT_EQ(said["level"], 1);
  EXPECT_EQ(said["type"], "f32");
  EXPECT_EQ(said["channels"], nlohmann::json{0});
  EXPECT_EQ(said["window"], nlohmann::json::parse("[[0.0, 1.0]]"));
  const VolumeInfo info = VolumeFile(sampleVolume("smoke", 96)).info();
  EXPECT_EQ(said["width"], info.levels[1].dims.x);
  EXPECT_EQ(said["height"], info.levels[1].dims.z);
  const double spacing = glm::length(glm::dvec3(info.world_from_index[0]));
  EXPECT_EQ(said["pixel"], (nlohmann::json{2 * spacing, 2 * spacing}));
  EXPECT_EQ(said["right"], (nlohmann::json{2 * info.world_from_index[0][0], 0.0, 0.0}));
  const glm::dvec3 corner(info.world_from_index * glm::dvec4(0, 30, 0, 1));
  EXPECT_EQ(said["corner"], (nlohmann::json{corner.x, corner.y, corner.z}));
}

TEST(Slice, IsNotSentAgainToWhoHasIt) {
  RunningServer server;
  const std::string target = sliceOf("rock", "axis=z&index=10");
  const auto first = get(server.port(), target);
  const std::string etag = first.fields.at("etag");
  EXPECT_EQ(get(server.port(), target, "If-None-Match: " + etag + "\r\n").status, 304);
  EXPECT_EQ(get(server.port(), sliceOf("rock", "index=10&axis=z")).fields.at("etag"), etag) << "whatever the order";
  EXPECT_NE(get(server.port(), sliceOf("rock", "axis=z&index=11")).fields.at("etag"), etag);
  WireClient client(server.port());
  client.send("HEAD " + target + " HTTP/1.1\r\nHost: localhost\r\n\r\n");
  const auto head = client.readReply(false);
  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.fields.at("etag"), etag);
}

TEST(Slice, IsOfOneStep) {
  const auto path = twoSteps("slices", [](unsigned step) {
    return volume_test::randomSource(VoxelType::u16, {60, 30, 20}, 1 + step, false, 2);
  });
  RunningServer server({.files = {path}});
  const std::string query = "axis=z&index=10&format=raw&channels=1,0&time=";
  const auto first = get(server.port(), sliceOf("slices", query + "0"));
  const auto second = get(server.port(), sliceOf("slices", query + "1"));
  EXPECT_EQ(first.body.size(), 60u * 30 * 2 * 2);
  EXPECT_FALSE(first.body == second.body);
  const std::string region = "/api/v1/volumes/slices/region?format=raw&box=0,0,10,60,30,11&channels=1,0&time=";
  EXPECT_TRUE(first.body == get(server.port(), region + "0").body);
  EXPECT_TRUE(second.body == get(server.port(), region + "1").body);
  EXPECT_EQ(get(server.port(), sliceOf("slices", query + "2")).json()["field"], "time");
}

TEST(Slice, RefusesWhatTheVolumeHasNot) {
  RunningServer server({.max_region = 2000});
  const auto fault = [&](const std::string& query) {
    const auto reply = get(server.port(), sliceOf("rock", query));
    return fmt::format("{} {} {}", reply.status, reply.json().value("field", ""),
                       reply.json()["detail"].get<std::string>());
  };
  EXPECT_THAT(fault("axis=x&index=48"), HasSubstr("400 index index: 48 is not within 0..47, the voxels along x"));
  EXPECT_THAT(fault("axis=z&index=1&level=9"), HasSubstr("400 level level: 9 is not within 0.."));
  EXPECT_THAT(fault("axis=z&index=1&box=0,0,0,1,1,500"), HasSubstr("400 box box: 0..500 along z"));
  EXPECT_THAT(fault("axis=z&index=1&channels=1"), HasSubstr("400 channels channels: 1 is not within 0..0"));
  EXPECT_THAT(fault("axis=z&index=1&window=0:1"), HasSubstr("400 window this volume has its own colours"));
  EXPECT_THAT(fault("axis=z&index=1&%00=1"), HasSubstr("400 ? ?: is no member of a slice"));
  EXPECT_THAT(fault(""), HasSubstr("400 axis axis: is missing"));
  EXPECT_THAT(fault("axis=z&index=1&format=raw"), HasSubstr("413 level the slice has 6144 bytes"));
  EXPECT_EQ(get(server.port(), sliceOf("none", "axis=z&index=1")).status, 404);
  EXPECT_EQ(post(server.port(), sliceOf("rock", "axis=z&index=1"), "{}").status, 405);
  EXPECT_EQ(get(server.port(), sliceOf("rock", "axis=z&index=1"), "Accept: text/plain\r\n").status, 406);
  EXPECT_EQ(get(server.port(), sliceOf("rock", "axis=z&index=1"), "Accept: image/*\r\n").status, 200);
}

// More at once than there are places: each is either answered right or told to come again, and no place is lost.
TEST(Slice, IsForSeveralClientsAtOnce) {
  const auto volume = sampleVolume("smoke", 96);
  RunningServer server({.files = {volume}});
  const std::string query = "axis=x&index=50&thickness=64&reduce=mean&format=raw";
  const std::string expected = madeSlice(volume, query);
  std::atomic<int> right = 0;
  std::atomic<int> refused = 0;
  std::vector<std::thread> clients;
  for (int i = 0; i < 12; ++i) {
    clients.emplace_back([&] {
      for (int j = 0; j < 5; ++j) {
        const auto reply = get(server.port(), sliceOf("smoke", query));
        if (reply.status == 200 && reply.body == expected) ++right;
        if (reply.status == 429 && reply.fields.contains("retry-after")) ++refused;
      }
    });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(right + refused, 60);
  EXPECT_GT(right, 0);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(get(server.port(), sliceOf("smoke", query)).status, 200);
}

// Nobody can interrupt an encoder: it has a thread of its own, and all that reads goes on.
TEST(Slice, LetsOthersReadWhileItIsEncoded) {
  const auto volume = sampleVolume("smoke", 96);
  const std::string query =
      "centre=48,48,48&right=1,0.4,0.2&down=0,1,0.3&pixel=0.02&size=1600x1600&filter=linear&format=webp";
  const SliceRequest request = readSliceRequest(parseQueryString(query));
  const VolumeFile file(volume);
  const ResolvedSlice slice = resolveSlice(request, file.info());
  const auto reader = makeSliceReader(file, slice.plan);
  while (reader->step()) continue;
  const SlicePixels pixels = reader->take();
  const std::vector<std::byte> expected = encodeSlice(file, slice, pixels);
  RunningServer server({.files = {volume}});
  // Of small ones that are asked for one after the other: how many come while it is being encoded. That is the last
  // quarter of what it takes, but for the sending.
  const auto comeBesideIt = [&] {
    using Clock = std::chrono::steady_clock;
    std::atomic<bool> is_there = false;
    Clock::time_point end;
    const Clock::time_point begin = Clock::now();
    std::thread client([&] {
      const auto reply = get(server.port(), sliceOf("smoke", query));
      end = Clock::now();
      is_there = true;
      EXPECT_EQ(reply.status, 200);
      EXPECT_TRUE(std::ranges::equal(std::as_bytes(std::span(reply.body)), expected));
    });
    std::vector<Clock::time_point> came;
    while (!is_there) {
      EXPECT_EQ(get(server.port(), sliceOf("smoke", "axis=z&index=9&format=raw")).status, 200);
      came.push_back(Clock::now());
    }
    client.join();
    const auto at = [&](double share) {
      return begin + std::chrono::duration_cast<Clock::duration>(share * (end - begin));
    };
    return std::ranges::count_if(came, [&](Clock::time_point time) { return time > at(0.78) && time < at(0.9); });
  };
  // Who waits for the encoder comes when it is done.
  EXPECT_TRUE(eventually([&] { return comeBesideIt() >= 4; })) << "they wait for the encoder";
}

TEST(Slice, EndsWithTheClientThatAskedForIt) {
  const auto volume = sampleVolume("smoke", 96);
  RunningServer server({.files = {volume}});
  // Minutes of work: a slab through all of it, in millions of pixels.
  const std::string query = "centre=48,48,48&right=1,0,0&down=0,1,0&pixel=0.03&size=4000x4000&thickness=96&level=0";
  {
    std::vector<WireClient> clients;
    for (int i = 0; i < 4; ++i) {
      clients.emplace_back(server.port());
      clients.back().send(fmt::format("GET {} HTTP/1.1\r\nHost: localhost\r\n\r\n", sliceOf("smoke", query)));
    }
    EXPECT_TRUE(eventually([&] { return get(server.port(), sliceOf("smoke", "axis=z&index=1")).status == 429; }));
    EXPECT_EQ(get(server.port(), "/api/v1/volumes/smoke/image?size=8x8").status, 200) << "pictures go on beside it";
  }
  EXPECT_TRUE(eventually([&] { return get(server.port(), sliceOf("smoke", "axis=z&index=1")).status == 200; }));
}

TEST(Slice, OfAFileThatIsGoneOrBrokenSaysSo) {
  const auto path = scratchFolder() / "sliced.bwv";
  std::filesystem::copy_file(sampleVolume("rock"), path, std::filesystem::copy_options::overwrite_existing);
  RunningServer server({.files = {path}});
  const std::string target = sliceOf("sliced", "axis=z&index=20&format=raw");
  ASSERT_EQ(get(server.port(), target).status, 200);
  const auto when = std::filesystem::last_write_time(path);
  {
    std::fstream stream(path, std::ios::binary | std::ios::in | std::ios::out);
    stream.seekp(-100, std::ios::end);
    stream.put('\x55');
  }
  std::filesystem::last_write_time(path, when);
  const auto broken = get(server.port(), target);
  EXPECT_EQ(broken.status, 503);
  EXPECT_THAT(broken.json()["detail"].get<std::string>(), HasSubstr("the volume failed: "));
  std::filesystem::remove(path);
  const auto gone = get(server.port(), target);
  EXPECT_EQ(gone.status, 503);
  EXPECT_THAT(gone.json()["detail"].get<std::string>(), HasSubstr("sliced: the file is gone"));
}

}  // namespace
}  // namespace blockwalk
