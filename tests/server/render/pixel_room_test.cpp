// SPDX-License-Identifier: Apache-2.0
#include "server/render/pixel_room.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace blockwalk {
namespace {

using Use = PixelRoom::Use;
using Lease = PixelRoom::Lease;

constexpr std::int64_t kMillion = 1000000;
constexpr std::int64_t kLargest = std::int64_t{8192} * 8192;

TEST(PixelRoom, SlowReadersOfOnePeerLeaveRoomForOthers) {
  PixelRoom room(256 * kMillion, 32);
  std::vector<std::unique_ptr<Lease>> leases;
  const auto fill = [&](std::uint64_t peer) {
    for (std::int64_t pixels = kLargest; pixels > 1000; pixels /= 2) {
      while (room.hasRoom(Use::request, peer, pixels)) {
        leases.push_back(std::make_unique<Lease>(room, Use::request, peer, pixels));
      }
    }
  };
  fill(1);
  EXPECT_LE(room.held(), 144 * kMillion);
  EXPECT_TRUE(room.hasRoom(Use::request, 2, 40 * kMillion)) << "another's request";
  for (std::uint64_t peer = 2; peer < 40; ++peer) fill(peer);
  EXPECT_LE(room.held(), 192 * kMillion);
  EXPECT_TRUE(room.hasRoom(Use::stream, 1, 60 * kMillion)) << "streams have what requests may not hold";
  leases.clear();
  EXPECT_EQ(room.held(), 0);
  EXPECT_EQ(room.requests(), 0);
}

TEST(PixelRoom, StreamsOfOnePeerLeaveRoomForOthers) {
  PixelRoom room(256 * kMillion, 32);
  std::vector<std::unique_ptr<Lease>> leases;
  while (room.hasRoom(Use::stream, 1, kMillion)) {
    leases.push_back(std::make_unique<Lease>(room, Use::stream, 1, kMillion));
  }
  EXPECT_EQ(leases.size(), 192u);
  EXPECT_TRUE(room.hasRoom(Use::stream, 2, 60 * kMillion));
}

TEST(PixelRoom, WhatIsLargerThanItsShareGoesAlone) {
  PixelRoom room(68 * kMillion, 32);
  EXPECT_TRUE(room.hasRoom(Use::request, 1, 3 * kLargest));
  const Lease small(room, Use::request, 2, 1);
  EXPECT_FALSE(room.hasRoom(Use::request, 1, kLargest));
  EXPECT_TRUE(room.hasRoom(Use::stream, 1, kLargest)) << "no stream holds any";
}

TEST(PixelRoom, RequestsAreBoundedInNumber) {
  PixelRoom room(256 * kMillion, 8);
  std::vector<std::unique_ptr<Lease>> leases;
  while (room.hasRoom(Use::request, 1, 1)) leases.push_back(std::make_unique<Lease>(room, Use::request, 1, 1));
  EXPECT_EQ(leases.size(), 6u);
  EXPECT_TRUE(room.hasRoom(Use::request, 2, 1));
  leases.push_back(std::make_unique<Lease>(room, Use::request, 2, 1));
  leases.push_back(std::make_unique<Lease>(room, Use::request, 2, 1));
  EXPECT_FALSE(room.hasRoom(Use::request, 3, 1));
}

TEST(PixelRoom, AnEncodedFrameCountsAsItsBytes) {
  PixelRoom room(256 * kMillion, 8);
  Lease lease(room, Use::stream, 1, kMillion);
  lease.setBytes(4001);
  EXPECT_EQ(room.held(), 1001);
}

}  // namespace
}  // namespace blockwalk
