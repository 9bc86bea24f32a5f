// SPDX-License-Identifier: Apache-2.0
#include "volume/host_limits.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace blockwalk::test {
namespace {

// Files as the kernel writes them.
class HostLimits : public testing::Test {
 protected:
  ~HostLimits() override { std::filesystem::remove_all(folder_); }
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
      std::filesystem::temp_directory_path() / fmt::format("blockwalk_host_limits_{}", getpid());
};

TEST_F(HostLimits, MemoryIsWhatTheTightestGroupLeavesAndItsOldFilesAreFree) {
  EXPECT_LT(freeHostBytes(), std::uint64_t{1} << 48);  // the real one
  write("proc/meminfo", "MemTotal: 99999 kB\nMemAvailable:    50000 kB\n");
  EXPECT_EQ(free(), 50000u << 10);  // no groups
  write("proc/self/cgroup", "1:name=systemd:/x\n0::/user/job\n");
  writeGroup("/user/job", "max", 5000000, 0);
  writeGroup("/user", "40000000", 30000000, 25000000);
  EXPECT_EQ(free(), 35000000u);  // of the group above: what was read is mostly free
  writeGroup("/user/job", "9000000", 5000000, 0);
  EXPECT_EQ(free(), 4000000u);
  writeGroup("/user/job", "9000000", 9500000, 100);
  EXPECT_EQ(free(), 0u);
  write("proc/self/cgroup", "0::/\n");  // in a namespace of its own the group is the root
  writeGroup("", "7000000", 6000000, 1000000);
  EXPECT_EQ(free(), 2000000u);
}

TEST_F(HostLimits, ProcessorsAreNoMoreThanTheTightestGroupHas) {
  const int all = hostProcessors().to_run_on;
  ASSERT_GE(all, 1);
  EXPECT_LE(hostProcessors().to_use, all);  // the real one
  const auto toUse = [&] { return hostProcessors((folder_ / "proc").c_str(), (folder_ / "cgroup").c_str()).to_use; };
  EXPECT_EQ(toUse(), all);  // no groups
  write("proc/self/cgroup", "0::/user/job\n");
  write("cgroup/user/job/cpu.max", "max 100000\n");
  EXPECT_EQ(toUse(), all);
  write("cgroup/user/cpu.max", "50000 100000\n");
  EXPECT_EQ(toUse(), 1) << "a half is one at a time";
  write("cgroup/user/cpu.max", "150000 100000\n");
  EXPECT_EQ(toUse(), std::min(all, 2));
  write("cgroup/user/cpu.max", "18446744073709551615 1\n");
  EXPECT_EQ(toUse(), all);
  for (const char* odd : {"", "100000", "100000 0", "-5 100000", "nothing at all"}) {
    write("cgroup/user/cpu.max", odd);
    EXPECT_GE(toUse(), 1) << odd;
    EXPECT_LE(toUse(), all) << odd;
  }
}

}  // namespace
}  // namespace blockwalk::test
