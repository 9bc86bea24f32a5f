// SPDX-License-Identifier: Apache-2.0
#include "volume/file/check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/volume/file/file_contents.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"

namespace blockwalk::volume_test {
namespace {

// Two channels, several levels, maxima.
std::string wholeFile(const ScratchFolder& folder) {
  MemorySource source = randomSource(VoxelType::u16, {90, 70, 60}, 5, false, 2);
  buildVolume(source, folder / "whole.bwv", {.subblock_side = 4, .block_side = 2});
  return readBytes(folder / "whole.bwv");
}

std::uint64_t pageCount(const VolumeInfo& info) {
  std::uint64_t pages = 0;
  for (int level = 0; level < static_cast<int>(info.levels.size()); ++level) {
    for (const Form form : {Form::values, Form::maxima}) {
      if (info.has(level, form)) pages += info.channels.size() * info.level(level, form).block_count;
    }
  }
  return pages;
}

TEST(FileCheck, EveryPageOfAGoodFileIsRight) {
  const ScratchFolder folder;
  wholeFile(folder);
  const VolumeFile file(folder / "whole.bwv");
  std::uint64_t last = 0;
  const FileCheck found = checkFile(file, [&](std::string_view, std::uint64_t done, std::uint64_t total) {
    EXPECT_EQ(done, last + 1);
    EXPECT_EQ(total, pageCount(file.info()));
    last = done;
  });
  EXPECT_EQ(found.faults, 0u);
  EXPECT_EQ(found.pages, pageCount(file.info()));
  EXPECT_EQ(last, found.pages);
  EXPECT_GE(file.bytesRead(), found.voxel_bytes);
}

// The voxels of level 0 come last: what is wrong is found, and what is right is counted all the same.
TEST(FileCheck, EveryFaultIsFound) {
  const ScratchFolder folder;
  std::string bytes = wholeFile(folder);
  for (const std::size_t from_end : {1u, 30000u}) {
    char& byte = bytes[bytes.size() - from_end];
    byte = static_cast<char>(~byte);
  }
  writeBytes(folder / "bad.bwv", bytes);
  const VolumeFile file(folder / "bad.bwv");
  const FileCheck found = checkFile(file, {});
  EXPECT_EQ(found.faults, 2u);
  EXPECT_EQ(found.pages, pageCount(file.info()) - 2);
  ASSERT_EQ(found.reasons.size(), 2u);
  EXPECT_THAT(found.reasons[0], testing::HasSubstr("bad.bwv"));
}

// No more than some are told, and all are counted.
TEST(FileCheck, AFileThatShrankIsAFaultAPage) {
  const ScratchFolder folder;
  wholeFile(folder);
  const VolumeFile file(folder / "whole.bwv");
  std::filesystem::resize_file(folder / "whole.bwv", file.fileBytes() / 4);
  const FileCheck found = checkFile(file, {});
  EXPECT_GT(found.faults, kMostReasons);
  EXPECT_EQ(found.reasons.size(), kMostReasons);
}

}  // namespace
}  // namespace blockwalk::volume_test
