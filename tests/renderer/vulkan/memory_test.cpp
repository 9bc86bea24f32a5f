// SPDX-License-Identifier: Apache-2.0
// Device memory: small pieces share pages, all of it comes back, and what would not fit is refused before it is asked
// for.
#include "renderer/vulkan/memory.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <random>
#include <string>

#include "renderer/vulkan/buffer.h"
#include "renderer/vulkan/host_memory.h"

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

// Files as the kernel writes them.
class HostMemory : public testing::Test {
 protected:
  ~HostMemory() override { std::filesystem::remove_all(folder_); }
  void write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
  }
  void writeGroup(const std::string& group, const std::string& most, std::uint64_t used, std::uint64_t cached) const {
    write("cgroup" + group + "/memory.max", most + "\n");
    write("cgroup" + group + "/memory.current", fmt::format("{}\n", used));
    write("cgroup" + group + "/memory.stat", fmt::format("anon 1\nfile 77\ninactive_file {}\nactive_file 3\n", cached));
  }
  std::uint64_t free() const { return freeHostBytes((folder_ / "proc").c_str(), (folder_ / "cgroup").c_str()); }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / fmt::format("blockwalk_host_memory_{}", getpid());
};

TEST_F(HostMemory, IsWhatTheTightestGroupLeavesAndItsOldFilesAreFree) {
  EXPECT_LT(freeHostBytes(), std::uint64_t{1} << 48);  // the real one
  write("proc/meminfo", "MemTotal: 99999 kB\nMemAvailable:    50000 kB\n");
  EXPECT_EQ(free(), 50000u << 10);  // no groups
  write("proc/self/cgroup", "1:name=systemd:/x\n0::/user/work\n");
  writeGroup("/user/work", "max", 5000000, 0);
  writeGroup("/user", "40000000", 30000000, 25000000);
  EXPECT_EQ(free(), 35000000u);  // of the group above: what was read is mostly free
  writeGroup("/user/work", "9000000", 5000000, 0);
  EXPECT_EQ(free(), 4000000u);
  writeGroup("/user/work", "9000000", 9500000, 100);
  EXPECT_EQ(free(), 0u);
  write("proc/self/cgroup", "0::/\n");  // in a namespace of its own the group is the root
  writeGroup("", "7000000", 6000000, 1000000);
  EXPECT_EQ(free(), 2000000u);
}

}  // namespace
}  // namespace blockwalk::test
