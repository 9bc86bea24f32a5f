// SPDX-License-Identifier: Apache-2.0
// A folder that is there whole or not at all, whoever is killed.
#include "volume/export/output_folder.h"

#include <gtest/gtest.h>

#include "tests/volume/memory_source.h"
#include "volume/error.h"

namespace blockwalk::volume_test {
namespace {

namespace fs = std::filesystem;

TEST(OutputFolder, IsThereOnceItIsComplete) {
  const ScratchFolder scratch;
  {
    OutputFolder given_up(scratch / "out");
    writeBytes(given_up.partialPath() / "a", "1");
  }
  EXPECT_TRUE(fs::is_empty(scratch.path));
  OutputFolder folder(scratch / "out");
  writeBytes(folder.partialPath() / "a", "1");
  EXPECT_FALSE(fs::exists(scratch / "out"));
  folder.commit();
  EXPECT_EQ(readBytes(scratch.path / "out" / "a"), "1");
  EXPECT_THROW(OutputFolder(scratch / "out"), DataError);
}

TEST(OutputFolder, TheNextRemovesWhatAKilledOneLeft) {
  const ScratchFolder scratch;
  for (const char* name : {".out.partial-0123abcd", ".other.partial-0123abcd", ".out.partial-notahexa"}) {
    fs::create_directories(scratch / name);
    writeBytes(scratch / name / "brick", "voxels");
  }
  const OutputFolder under_way(scratch / "out");
  EXPECT_FALSE(fs::exists(scratch / ".out.partial-0123abcd"));
  EXPECT_TRUE(fs::exists(scratch / ".other.partial-0123abcd"));
  EXPECT_TRUE(fs::exists(scratch / ".out.partial-notahexa"));
  // One that is still being written stays.
  const OutputFolder second(scratch / "out");
  EXPECT_TRUE(fs::exists(under_way.partialPath()));
  EXPECT_NE(second.partialPath(), under_way.partialPath());
}

// A link of such a name leads nowhere that is removed.
TEST(OutputFolder, ALinkIsNotFollowed) {
  const ScratchFolder scratch;
  fs::create_directories(scratch / "mine");
  writeBytes(scratch.path / "mine" / "a", "1");
  fs::create_directory_symlink(scratch / "mine", scratch / ".out.partial-0123abcd");
  const OutputFolder folder(scratch / "out");
  EXPECT_TRUE(fs::exists(scratch.path / "mine" / "a"));
}

}  // namespace
}  // namespace blockwalk::volume_test
