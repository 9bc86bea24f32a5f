// SPDX-License-Identifier: Apache-2.0
// Voxels that come and go where memory or the file falls short.
#include <gtest/gtest.h>

#include <fstream>

#include "tests/renderer/pages_stage.h"

namespace blockwalk::test {
namespace {

// Whatever the budget leaves for voxels, and where a level would fit but for what else is needed with it.
TEST_F(PagesTest, WithABudgetAloneWhatDoesNotFitComesAndGoes) {
  Scene scene = makeScene(*ball(160), kSmallBlocks);
  View view = finest(64);
  view.filter = Filter::linear;
  const Frame expected = renderer().render(*scene.resident, view);
  DeviceOptions options;
  OwnRendererTest::start(scene.path, options);
  EXPECT_FALSE(renderer_->render(*volume_, view).stats.paged);
  const std::uint64_t everything = renderer_->device().memory_used_bytes;
  int paged = 0;
  for (int tenths = 4; tenths <= 10; ++tenths) {
    options.memory_budget_bytes = everything * static_cast<std::uint64_t>(tenths) / 10 + 64 * kKib;
    OwnRendererTest::start(scene.path, options);
    SCOPED_TRACE(tenths);
    for (int round = 0; round < 2; ++round) {
      const auto frame = renderer_->begin(*volume_, orderOf(view));
      for (bool more = true; more;) {
        more = frame->advance();
        EXPECT_LE(renderer_->device().memory_used_bytes, options.memory_budget_bytes);
      }
      const Frame drawn = frame->finish();
      paged += drawn.stats.paged ? 1 : 0;
      EXPECT_TRUE(drawn.stats.isComplete());
      EXPECT_EQ(drawn.pixels, expected.pixels);
    }
  }
  EXPECT_GE(paged, 10);
  EXPECT_LT(paged, 14) << "the largest holds the level";
}

// Records do not come and go: where those of a level find no room, `auto` takes a coarser one, and says so.
TEST_F(PagesTest, WhereRecordsFindNoRoomAutoIsCoarser) {
  Scene scene = makeScene(*ball(200), kSmallBlocks);
  View view = finest(32);
  DeviceOptions options;
  options.memory_budget_bytes = 320 * kKib;
  OwnRendererTest::start(scene.path, options);
  EXPECT_THROW(renderer_->render(*volume_, view), OutOfDeviceMemory);
  view.level = kAutoLevel;
  view.eye = glm::dvec3(100, 110, 198);  // so near that the finest level is wanted
  view.target = glm::dvec3(100, 100, 0);
  View same = view;
  same.level = 1;
  ASSERT_EQ(renderer().render(*scene.resident, view).stats.level, 0);
  for (int round = 0; round < 2; ++round) {
    const Frame frame = renderer_->render(*volume_, view);
    EXPECT_EQ(frame.stats.level, 1);
    EXPECT_FALSE(frame.stats.isComplete());
    EXPECT_EQ(frame.pixels, renderer().render(*scene.resident, same).pixels);
  }
}

// Bits of the last half, where the voxels of level 0 are; the second time they are as they were.
void invertVoxels(const std::filesystem::path& path) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  const auto bytes = static_cast<std::streamoff>(std::filesystem::file_size(path));
  std::string last(static_cast<std::size_t>(bytes / 2), '\0');
  file.seekg(bytes - bytes / 2);
  file.read(last.data(), bytes / 2);
  for (char& c : last) c = static_cast<char>(~c);
  file.seekp(bytes - bytes / 2);
  file.write(last.data(), bytes / 2);
}

std::filesystem::path copyOf(const Scene& scene, const char* name) {
  std::filesystem::path copy = scene.path.parent_path() / name;
  std::filesystem::copy_file(scene.path, copy, std::filesystem::copy_options::overwrite_existing);
  return copy;
}

TEST_F(PagesTest, WhatCannotBeReadIsCoarserThereUntilItCan) {
  Scene scene = makeScene(*ball(120), kSmallBlocks);
  const std::filesystem::path copy = copyOf(scene, "damaged.bwv");
  start(copy, 640 * kKib);
  View view = finest(64);
  view.channels[0].transfer = {{.value = 100, .color = {1, 1, 1}, .opacity = 1}};
  const Frame complete = renderer().render(*scene.resident, view);
  invertVoxels(copy);
  const Frame damaged = renderer_->render(*volume_, view);
  EXPECT_FALSE(damaged.stats.isComplete());
  EXPECT_NE(damaged.stats.page_failure.find("damaged.bwv"), std::string::npos) << damaged.stats.page_failure;
  for (std::size_t i = 0; i < complete.pixels.size(); ++i) {
    if ((complete.pixels[i] & 0xffffff) == 0) continue;
    EXPECT_NE(damaged.pixels[i] & 0xffffff, 0u) << i;
  }
  invertVoxels(copy);
  const Frame healed = renderer_->render(*volume_, view);
  EXPECT_TRUE(healed.stats.isComplete());
  EXPECT_EQ(healed.stats.page_failure, "");
  EXPECT_EQ(healed.pixels, complete.pixels);
}

// Nothing is added to samples that were shown coarser.
TEST_F(PagesTest, ARefinementThatLackedSomethingBeginsAnew) {
  Scene scene = makeScene(*ball(120), kSmallBlocks);
  const std::filesystem::path copy = copyOf(scene, "refined.bwv");
  start(copy, 640 * kKib);
  View view = finest(48);
  view.samples = 4;
  view.channels[0].transfer = {{.value = 100, .color = {1, 1, 1}, .opacity = 1}};
  const Frame expected = renderer().render(*scene.resident, view);
  const auto step = [&](int begin, int end) {
    FrameOrder order = orderOf(view);
    order.step = SampleStep{.owner = 3, .begin = begin, .end = end};
    return renderer_->render(*volume_, std::move(order));
  };
  invertVoxels(copy);
  EXPECT_FALSE(step(0, 2).stats.isComplete());
  invertVoxels(copy);
  const Frame last = step(2, 4);
  EXPECT_TRUE(last.stats.isComplete());
  EXPECT_EQ(last.samples_drawn, 4);
  EXPECT_EQ(last.pixels, expected.pixels);
}

}  // namespace
}  // namespace blockwalk::test
