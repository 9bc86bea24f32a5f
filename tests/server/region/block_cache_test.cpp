// SPDX-License-Identifier: Apache-2.0
#include "server/region/block_cache.h"

#include <gtest/gtest.h>

#include "tests/server/running_server.h"
#include "volume/error.h"

namespace blockwalk {
namespace {

TEST(BlockCache, ReadsALevelOnce) {
  const VolumeFile file(sampleVolume("rock", 96));
  BlockCache cache;
  const auto first = cache.of(file, "a", 0);
  ASSERT_GT(first->blocks.size(), 0u);
  EXPECT_EQ(cache.of(file, "a", 0), first);
  EXPECT_NE(cache.of(file, "a", 1), first) << "another level";
  EXPECT_NE(cache.of(file, "b", 0), first) << "another content";
  EXPECT_EQ(cache.of(file, "a", 0), first);
  const std::uint64_t before = file.bytesRead();
  cache.of(file, "b", 0);
  EXPECT_EQ(file.bytesRead(), before);
}

}  // namespace
}  // namespace blockwalk
