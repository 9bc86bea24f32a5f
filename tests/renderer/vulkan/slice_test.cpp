// SPDX-License-Identifier: Apache-2.0
// Small ones share buffers, do not overlap, and all of them come back.
#include "renderer/vulkan/slice.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace blockwalk::test {
namespace {

class SliceTest : public testing::Test {
 protected:
  Device device{DeviceOptions{}};
};

TEST_F(SliceTest, ManyAreFewAllocationsAndDoNotOverlap) {
  const std::size_t before = device.memory().allocations();
  std::mt19937 random(5);
  std::vector<Slice> slices;
  std::uint64_t bytes = 0;
  for (int i = 0; i < 6000; ++i) {
    if (i % 3 == 2) {
      const auto gone = slices.begin() + static_cast<std::ptrdiff_t>(random() % slices.size());
      bytes -= gone->bytes();
      slices.erase(gone);
    }
    slices.emplace_back(device, 1 + random() % 9000);
    bytes += slices.back().bytes();
    ASSERT_EQ(device.memory().usedBytes(BufferUse::resident), bytes);
  }
  // Of what was given back nearly all is taken again.
  EXPECT_LE(device.memory().allocations() - before, 2 + bytes * 5 / 4 / Memory::kPageBytes);
  std::map<std::uint64_t, std::uint64_t> ends;
  for (const Slice& slice : slices) ends[slice.address()] = slice.address() + slice.bytes();
  ASSERT_EQ(ends.size(), slices.size());
  std::uint64_t last = 0;
  for (const auto& [begin, end] : ends) {
    EXPECT_GE(begin, last);
    EXPECT_EQ(begin % Memory::kGranule, 0u);
    last = end;
  }
  slices.clear();
  EXPECT_EQ(device.memory().usedBytes(), 0u);
  EXPECT_EQ(device.memory().allocations(), before);
}

TEST_F(SliceTest, ALargeOneIsItsOwn) {
  const std::uint64_t bytes = Memory::kMostSmallBytes + 1;
  Slice slice(device, bytes);
  EXPECT_EQ(slice.bytes(), Slice::bytesFor(bytes));
  EXPECT_NE(slice.address(), 0u);
  Slice other = std::move(slice);
  EXPECT_EQ(other.bytes(), bytes);
  other = {};
  EXPECT_EQ(device.memory().usedBytes(), 0u);
}

// A page has what was free in a row found again, whatever was looked for in vain before.
TEST_F(SliceTest, WhatIsGivenBackIsFoundAgain) {
  std::vector<Slice> slices;
  const std::size_t in_page = Memory::kPageBytes / 4096;
  for (std::size_t i = 0; i < in_page; ++i) slices.emplace_back(device, 4096);
  const std::size_t full = device.memory().allocations();
  const std::uint64_t address = slices[7].address();
  slices[7] = {};
  slices[8] = {};
  EXPECT_EQ(Slice(device, 8192).address(), address);
  const Slice too_large(device, 12288);
  EXPECT_EQ(device.memory().allocations(), full + 1);
  slices[9] = {};
  EXPECT_EQ(Slice(device, 12288).address(), address);
}

}  // namespace
}  // namespace blockwalk::test
