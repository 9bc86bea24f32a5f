// SPDX-License-Identifier: Apache-2.0
#include "protocol/region_request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/query_string.h"
#include "view/view.h"

namespace blockwalk {
namespace {

RegionRequest read(std::string_view query) { return readRegionRequest(parseQueryString(query)); }

// The member to blame and the message, or "no error".
std::string fault(std::string_view query) {
  try {
    read(query);
  } catch (const ViewError& error) {
    return error.field + "|" + error.what();
  }
  return "no error";
}

TEST(RegionRequest, IsReadAndWritten) {
  EXPECT_EQ(read(""), RegionRequest{});
  const RegionRequest request = read("level=2&box=0,1,2,10,11,65536&channels=2,0&format=npy");
  EXPECT_EQ(request.format, "npy");
  EXPECT_EQ(request.level, 2);
  EXPECT_EQ(request.box, (VoxelBox{{0, 1, 2}, {10, 11, 65536}}));
  EXPECT_EQ(request.channels, (std::vector<int>{2, 0}));
  EXPECT_EQ(read(regionQuery(request)), request);
  EXPECT_EQ(read(regionQuery(RegionRequest{})), RegionRequest{});
  EXPECT_EQ(read("channels=all"), RegionRequest{});
}

TEST(RegionRequest, RefusesByMemberAndBound) {
  for (const auto& [query, expected] : {
           std::pair{"boxes=1", "boxes|boxes: is no member of a region"},
           {"level=1&level=1", "level|level: is named twice"},
           {"level=-1", "level|level: must be a whole number from 0 to 17"},
           {"level=18", "level|level: must be"},
           {"level=1.5", "level|level: must be"},
           {"box=1,2,3,4,5", "box|box: must be six numbers"},
           {"box=1,2,3,4,5,6,7", "box|box: must be six numbers"},
           {"box=", "box|box: must be a whole number"},
           {"box=0,0,0,1,1,65537", "box|box: must be a whole number from 0 to 65536"},
           {"box=0,0,0,1,1,-1", "box|box: must be"},
           {"box=0,0,0,1,0,1", "box|box: must have its first three numbers below the others"},
           {"box=0,0,0,1,1,1 ", "box|box: must be"},
           {"channels=0,0", "channels|channels: must name a channel once"},
           {"channels=4", "channels|channels: must be"},
           {"format=png", "format|format: must be nrrd, npy or raw, not 'png'"},
           {"format=", "format|format: must be"},
       }) {
    EXPECT_THAT(fault(query), testing::StartsWith(expected)) << query;
  }
}

}  // namespace
}  // namespace blockwalk
