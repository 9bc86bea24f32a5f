// SPDX-License-Identifier: Apache-2.0
// Building on a file system that has no locks.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>

#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"
#include "volume/file/file.h"

namespace {
int lock_error = 0;  // what every lock fails with, or 0
}

// In place of the library's, in this program.
extern "C" int flock(int descriptor, int operation) noexcept {
  if (lock_error != 0) {
    errno = lock_error;
    return -1;
  }
  return static_cast<int>(syscall(SYS_flock, descriptor, operation));
}

namespace blockwalk::volume_test {
namespace {

TEST(Locks, AFileSystemWithoutThemBuildsAndNamesWhatStays) {
  for (const int error : {ENOLCK, EOPNOTSUPP, ENOSYS}) {
    const ScratchFolder folder;
    MemorySource source = randomSource(VoxelType::u8, {20, 20, 20}, 3);
    writeBytes(folder / ".a.bwv.partial-0123abcd", "left");
    writeBytes(folder / ".b.bwv.partial-0123abcd", "another's");
    lock_error = error;
    const BuildReport report = buildVolume(source, folder / "a.bwv", {});
    lock_error = 0;
    EXPECT_EQ(VolumeFile(folder / "a.bwv").fileBytes(), report.file_bytes);
    EXPECT_THAT(report.leftovers, testing::ElementsAre(folder / ".a.bwv.partial-0123abcd"));
    EXPECT_TRUE(std::filesystem::exists(folder / ".a.bwv.partial-0123abcd"));

    // With locks it is known that nobody writes it.
    const BuildReport locked = buildVolume(source, folder / "a.bwv", {});
    EXPECT_TRUE(locked.leftovers.empty());
    EXPECT_FALSE(std::filesystem::exists(folder / ".a.bwv.partial-0123abcd"));
    EXPECT_TRUE(std::filesystem::exists(folder / ".b.bwv.partial-0123abcd"));
  }
}

TEST(Locks, APartialFileThatIsBeingWrittenStays) {
  const ScratchFolder folder;
  MemorySource source = randomSource(VoxelType::u8, {20, 20, 20}, 3);
  writeBytes(folder / ".a.bwv.partial-0123abcd", "being written");
  const int descriptor = ::open((folder / ".a.bwv.partial-0123abcd").c_str(), O_RDWR | O_CLOEXEC);
  ASSERT_EQ(::flock(descriptor, LOCK_EX | LOCK_NB), 0);
  EXPECT_TRUE(buildVolume(source, folder / "a.bwv", {}).leftovers.empty());
  EXPECT_TRUE(std::filesystem::exists(folder / ".a.bwv.partial-0123abcd"));
  ::close(descriptor);
}

}  // namespace
}  // namespace blockwalk::volume_test
