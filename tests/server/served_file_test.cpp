// SPDX-License-Identifier: Apache-2.0
// A volume file that is truncated or changed while it is served: that volume fails with a reason, nothing else does.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>

#include "running_server.h"

namespace blockwalk {
namespace {

std::filesystem::path copyOfRock(const std::string& name) {
  auto copy = scratchFolder() / name;
  std::filesystem::copy_file(sampleVolume("rock"), copy, std::filesystem::copy_options::overwrite_existing);
  return copy;
}

// Truncated and restored over and over while it is read: every read gives the right bytes or an error, never a signal.
TEST(ServedFile, TruncatedWhileItIsReadGivesErrorsAndNoSignal) {
  const auto path = copyOfRock("race.bwv");
  const VolumeFile file(path);
  std::ifstream stream(path, std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(stream)), {});
  std::atomic<bool> done = false;
  std::thread truncating([&] {
    while (!done) {
      std::filesystem::resize_file(path, 0);
      std::ofstream(path, std::ios::binary) << whole;
    }
  });
  std::vector<std::byte> voxels(static_cast<std::size_t>(file.info().levels[0].voxel_bytes));
  int errors = 0;
  for (int i = 0; i < 3000; ++i) {
    try {
      file.readLevel(0, 0);
      file.readVoxels(0, 0, 0, file.info().levels[0].subblock_count, voxels);
    } catch (const DataError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("race.bwv"));
      ++errors;
    }
  }
  done = true;
  truncating.join();
  EXPECT_GT(errors, 0) << "the file was never caught truncated";
}

TEST(ServedFile, TruncatedFailsThatVolumeWithAReasonAndTheRestServes) {
  const auto path = copyOfRock("cut.bwv");
  RunningServer server({.files = {path, sampleVolume("rock")}});
  server.control().read_voxels = true;
  ASSERT_EQ(get(server.port(), "/api/v1/volumes/cut/image?size=4x4").status, 200);
  StreamClient stream(server.port(), "cut");
  std::filesystem::resize_file(path, 3000);

  const auto image = get(server.port(), "/api/v1/volumes/cut/image?size=5x4");
  EXPECT_EQ(image.status, 503);
  EXPECT_TRUE(image.fields.contains("retry-after"));
  const std::string detail = image.json()["detail"];
  EXPECT_THAT(detail, testing::AllOf(testing::HasSubstr("cut.bwv"), testing::HasSubstr("shrank"),
                                     testing::Not(testing::HasSubstr("/"))));
  const auto ready = get(server.port(), "/readyz");
  EXPECT_EQ(ready.status, 200) << "another volume is usable";
  EXPECT_EQ(ready.json()["volumes"]["cut"], "failed");
  const nlohmann::json list = get(server.port(), "/api/v1/volumes").json();
  EXPECT_EQ(list["volumes"][0]["state"], "failed");
  EXPECT_THAT(std::string(list["volumes"][0]["error"]), testing::HasSubstr("shrank"));
  EXPECT_EQ(get(server.port(), "/api/v1/volumes/cut/image?size=6x4").status, 503);

  // A stream that was open gets the reason with each view, and stays open.
  for (int id = 1; id <= 2; ++id) {
    stream.sendText(fmt::format(R"({{"type":"view","id":{},"size":[4,4]}})", id));
    const nlohmann::json error = stream.readText("error");
    EXPECT_EQ(error["problem"]["status"], 503);
    EXPECT_THAT(std::string(error["problem"]["detail"]), testing::HasSubstr("shrank"));
  }
  EXPECT_EQ(get(server.port(), "/api/v1/volumes/rock/image?size=4x4").status, 200);
}

TEST(ServedFile, ReadinessAsksForAVolumeThatIsUsable) {
  const auto broken = scratchFolder() / "no-volume.bwv";
  std::ofstream(broken) << "this is no volume";
  RunningServer server({.files = {broken}}, false);
  server.control().hold_load = false;
  WireReply reply;
  EXPECT_TRUE(eventually([&] {
    reply = get(server.port(), "/readyz");
    return reply.json()["volumes"]["no-volume"] == "failed" && reply.json()["device"] == true;
  }));
  EXPECT_EQ(reply.status, 503);
  EXPECT_EQ(reply.json()["ready"], false);

  std::filesystem::create_directories(scratchFolder() / "no-volumes");
  RunningServer empty({.volumes = scratchFolder() / "no-volumes"}, false);
  EXPECT_TRUE(eventually([&] { return get(empty.port(), "/readyz").status == 200; })) << "nothing was asked for";
}

}  // namespace
}  // namespace blockwalk
