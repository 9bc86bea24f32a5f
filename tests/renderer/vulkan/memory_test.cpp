// SPDX-License-Identifier: Apache-2.0
// Device memory: small pieces share pages, all of it comes back, and what would not fit is refused before it is asked
// for.
#include "renderer/vulkan/memory.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "renderer/vulkan/buffer.h"

namespace blockwalk::test {
namespace {

class MemoryTest : public testing::Test {
 protected:
  Device device{DeviceOptions{}};
};

TEST_F(MemoryTest, ManySmallBuffersAreFewAllocationsAndDoNotOverlap) {
  const std::size_t before = device.memory().allocations();
  std::mt19937 random(3);
  std::vector<Buffer> buffers;
  for (int i = 0; i < 3000; ++i) {
    if (i % 3 == 2) buffers.erase(buffers.begin() + static_cast<std::ptrdiff_t>(random() % buffers.size()));
    buffers.emplace_back(device, 1 + random() % 9000, BufferUse::upload);
    std::ranges::fill(buffers.back().mapped(), static_cast<std::byte>(buffers.back().address() >> 10));
  }
  EXPECT_LE(device.memory().allocations() - before, 8u);
  std::map<std::uint64_t, std::uint64_t> ends;
  for (const Buffer& buffer : buffers) {
    ends[buffer.address()] = buffer.address() + buffer.bytes();
    const auto mark = static_cast<std::byte>(buffer.address() >> 10);
    EXPECT_TRUE(std::ranges::all_of(buffer.mapped(), [&](std::byte b) { return b == mark; }));
  }
  ASSERT_EQ(ends.size(), buffers.size());
  std::uint64_t last = 0;
  for (const auto& [begin, end] : ends) {
    EXPECT_GE(begin, last);
    last = end;
  }
  const std::uint64_t used = device.memory().usedBytes(BufferUse::upload);
  EXPECT_GE(used, 2000u * 1024);
  buffers.clear();
  EXPECT_EQ(device.memory().usedBytes(), 0u);
  EXPECT_EQ(device.memory().allocations(), before);
}

TEST_F(MemoryTest, RefusesWhatDoesNotFitWithBothNumbers) {
  const std::uint64_t free = device.memory().freeBytes();
  EXPECT_GT(free, 0u);
  try {
    device.memory().requireOfHost(std::uint64_t{1} << 50, "a picture");
    FAIL() << "nothing was refused";
  } catch (const OutOfDeviceMemory& error) {
    EXPECT_EQ(error.needed_bytes, std::uint64_t{1} << 50);
    EXPECT_GT(error.free_bytes, 0u);
    EXPECT_LT(error.free_bytes, error.needed_bytes);
  }
  try {
    const Buffer buffer(device, free + (std::uint64_t{1} << 30), BufferUse::resident);
    FAIL() << "nothing was refused";
  } catch (const OutOfDeviceMemory& error) {
    EXPECT_GT(error.needed_bytes, free);
  }
  EXPECT_EQ(device.memory().usedBytes(), 0u);
}

}  // namespace
}  // namespace blockwalk::test
