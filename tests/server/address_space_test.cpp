// SPDX-License-Identifier: Apache-2.0
// The daemon in an address space that is too small for what it is asked: it draws or refuses, and goes on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/daemon_process.h"
#include "tests/server/running_server.h"

namespace blockwalk {
namespace {

constexpr const char* kViews[] = {"size=64x64",
                                  "size=2048x2048",
                                  "size=2048x2048&filter=linear&lit=on",
                                  "size=2048x2048&mode=mip&samples=2",
                                  "size=1024x1024&finder=octree&mode=iso&filter=linear",
                                  "size=1024x1024&finder=clusters",
                                  "size=4096x4096&format=raw&mode=first-hit"};

class AddressSpace : public testing::TestWithParam<int> {};

TEST_P(AddressSpace, DrawsOrRefusesAndGoesOn) {
  const std::uint64_t bytes = static_cast<std::uint64_t>(GetParam()) << 20;
  DaemonProcess daemon({"--listen", "127.0.0.1:0", sampleVolume("rock").string()}, bytes);
  const std::uint16_t port = daemon.port();
  ASSERT_NE(port, 0) << daemon.seen();
  ASSERT_TRUE(eventually([&] { return !daemon.isAlive() || get(port, "/readyz").status == 200; }));
  int drawn = 0;
  for (const char* view : kViews) {
    const auto reply = get(port, std::string("/api/v1/volumes/rock/image?") + view);
    EXPECT_TRUE(reply.status == 200 || reply.status == 503)
        << view << ": " << reply.status << " " << reply.body.substr(0, 300);
    if (reply.status == 503) {
      EXPECT_THAT(reply.body, testing::HasSubstr("free")) << view;
    }
    drawn += reply.status == 200 ? 1 : 0;
    ASSERT_TRUE(daemon.isAlive()) << view << ": ended with " << daemon.status() << "\n" << daemon.seen();
  }
  EXPECT_EQ(get(port, "/healthz").status, 200);
  EXPECT_GE(drawn, GetParam() >= 1536 ? 4 : 0);
}

INSTANTIATE_TEST_SUITE_P(Mebibytes, AddressSpace, testing::Values(700, 850, 1024, 1536, 2048));

}  // namespace
}  // namespace blockwalk
