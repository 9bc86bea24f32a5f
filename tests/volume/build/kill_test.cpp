// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <iterator>
#include <random>
#include <stdexcept>

#include "tests/volume/file/file_contents.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"

namespace blockwalk::volume_test {
namespace {

pid_t startBuild(MemorySource& source, const std::filesystem::path& path) {
  const pid_t child = fork();
  if (child != 0) return child;
  try {
    buildVolume(source, path, {.subblock_side = 4});
    _exit(0);
  } catch (...) {
    _exit(1);
  }
}

TEST(BuilderKill, LeavesNoHalfFile) {
  const ScratchFolder folder;
  MemorySource source = randomSource(VoxelType::u8, {150, 150, 150}, 8);
  std::mt19937 random(8);
  for (std::byte& voxel : source.voxels) voxel = static_cast<std::byte>(random());
  const std::filesystem::path path = folder / "killed.bwv";

  const auto begin = std::chrono::steady_clock::now();
  int status = 0;
  waitpid(startBuild(source, path), &status, 0);
  ASSERT_EQ(status, 0);
  const auto whole_us =
      std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - begin).count();
  const std::string expected = readBytes(path);

  int killed = 0;
  for (int i = 0; i < 20; ++i) {
    std::filesystem::remove(path);
    const pid_t child = startBuild(source, path);
    usleep(static_cast<useconds_t>(random() % static_cast<unsigned>(whole_us)));
    kill(child, SIGKILL);
    waitpid(child, &status, 0);
    killed += WIFSIGNALED(status) ? 1 : 0;
    if (std::filesystem::exists(path)) {
      EXPECT_EQ(readBytes(path) == expected, true) << "run " << i;
    }
    for (const auto& entry : std::filesystem::directory_iterator(folder.path)) {
      const std::string name = entry.path().filename().string();
      EXPECT_TRUE(name == "killed.bwv" || name.starts_with(".killed.bwv.partial-")) << name;
    }
  }
  EXPECT_GT(killed, 0);
}

std::size_t filesIn(const ScratchFolder& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder.path), {}));
}

TEST(BuilderKill, TheNextBuildRemovesWhatAKilledOneLeft) {
  const ScratchFolder folder;
  writeBytes(folder / ".volume.bwv.partial-0123abcd", "of one that was killed");
  writeBytes(folder / ".other.bwv.partial-0123abcd", "another's");
  writeBytes(folder / ".volume.bwv.partial-notahexa", "a user's");
  MemorySource source = randomSource(VoxelType::u8, {20, 20, 20}, 8);
  buildVolume(source, folder / "volume.bwv", {});
  EXPECT_FALSE(std::filesystem::exists(folder / ".volume.bwv.partial-0123abcd"));
  EXPECT_TRUE(std::filesystem::exists(folder / ".other.bwv.partial-0123abcd"));
  EXPECT_TRUE(std::filesystem::exists(folder / ".volume.bwv.partial-notahexa"));
  EXPECT_EQ(filesIn(folder), 3u);
}

TEST(BuilderKill, ABuildThatStillRunsKeepsItsPartialFile) {
  const ScratchFolder folder;
  MemorySource source = randomSource(VoxelType::u8, {20, 20, 20}, 8);
  bool both = false;
  BuildOptions options;
  options.accept = [&](const std::filesystem::path& complete) {
    buildVolume(source, folder / "volume.bwv", {});
    both = std::filesystem::exists(complete);
  };
  buildVolume(source, folder / "volume.bwv", options);
  EXPECT_TRUE(both);
  EXPECT_EQ(filesIn(folder), 1u);
}

TEST(BuilderKill, AFileThatIsNotAcceptedGetsNoName) {
  const ScratchFolder folder;
  MemorySource source = randomSource(VoxelType::u8, {20, 20, 20}, 8);
  writeBytes(folder / "volume.bwv", "what was there");
  BuildOptions options;
  options.accept = [&](const std::filesystem::path& complete) {
    EXPECT_NO_THROW(readContents(complete));
    throw std::runtime_error("not this one");
  };
  EXPECT_THROW(buildVolume(source, folder / "volume.bwv", options), std::runtime_error);
  EXPECT_EQ(readBytes(folder / "volume.bwv"), "what was there");
  EXPECT_EQ(filesIn(folder), 1u);
}

}  // namespace
}  // namespace blockwalk::volume_test
