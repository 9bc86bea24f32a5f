// SPDX-License-Identifier: Apache-2.0
// Levels whose records are read by windows: pictures are those of all records, bit for bit, and windows that overlap
// share their pages.
#include <gtest/gtest.h>

#include "renderer/vulkan_volume.h"
#include "tests/renderer/pages_stage.h"
#include "tests/renderer/synthetic.h"
#include "tests/renderer/views.h"

namespace blockwalk::test {
namespace {

class RecordWindowsTest : public PagesTest {
 protected:
  void start(const std::filesystem::path& file, std::uint64_t page_bytes) {
    DeviceOptions options;
    options.page_bytes = page_bytes;
    options.record_bytes = 1;
    OwnRendererTest::start(file, options);
  }
  std::uint64_t partsOf(std::string_view part) const {
    for (const PartTotal& total : renderer_->parts()) {
      if (total.what == part) return total.count;
    }
    return 0;
  }
  // From inside of the volume, to one side of it.
  static View inside(const VolumeInfo& info, glm::dvec3 at, glm::dvec3 towards) {
    const WorldBox box = worldBox(info);
    View view = finest(64);
    view.eye = box.min + at * (box.max - box.min);
    view.target = *view.eye + towards;
    view.up = glm::dvec3(0.1, 1, 0.2);
    return view;
  }
};

const SyntheticOptions kVolume{.type = VoxelType::u8, .dims = {300, 280, 270}, .seed = 4};

TEST_F(RecordWindowsTest, PicturesAreThoseOfAllRecords) {
  Scene scene = makeScene(*makeSynthetic(kVolume), kSmallBlocks);
  start(scene.path, 1024 * kKib);
  const std::vector<Combination> finders = everyFinder();
  std::size_t number = 0;
  int whole = 0;
  std::vector<View> views = randomViews(scene.info, scene.dense(0), 11);
  views.resize(8);
  for (const glm::dvec3& at : {glm::dvec3(0.5), glm::dvec3(0.1, 0.2, 0.9), glm::dvec3(0.9, 0.1, 0.2)}) {
    for (const glm::dvec3& towards : {glm::dvec3(1, 0, 0), glm::dvec3(-1, 0.3, 0.2), glm::dvec3(0.1, -0.2, 1)}) {
      views.push_back(inside(scene.info, at, towards));
    }
  }
  for (View view : views) {
    view.filter = number % 3 == 0 ? Filter::nearest : Filter::linear;
    view.lit = number % 5 == 0;
    view = with(view, finders[number++ % finders.size()]);
    SCOPED_TRACE(toString(view));
    const auto [expected, frame] = drawBoth(scene, view);
    if (frame.stats.absent_blocks > 0) continue;
    ++whole;
    EXPECT_EQ(frame.pixels, expected.pixels);
    EXPECT_EQ(frame.stats.voxel_steps, expected.stats.voxel_steps);
  }
  EXPECT_GE(whole, 12);
  EXPECT_GT(partsOf("blocks"), 2u) << "different views have different windows";
}

TEST_F(RecordWindowsTest, EveryModeAndFartherLevels) {
  Scene scene = makeScene(*makeSynthetic(kVolume), kSmallBlocks);
  start(scene.path, 2048 * kKib);
  for (const Mode mode : {Mode::blend, Mode::first_hit, Mode::mip, Mode::minip, Mode::attenuated_mip, Mode::mean,
                          Mode::iso, Mode::blocks}) {
    for (const double lod : {1.0, 1.5}) {
      View view = inside(scene.info, glm::dvec3(0.1, 0.4, 0.1), glm::dvec3(1, 0.1, 0.8));
      view.mode = mode;
      view.filter = Filter::linear;
      view.level = kAutoLevel;
      view.lod = lod;
      SCOPED_TRACE(toString(view));
      const auto [expected, frame] = drawBoth(scene, view);
      EXPECT_EQ(frame.pixels, expected.pixels);
      EXPECT_EQ(frame.stats.absent_blocks, 0u);
      EXPECT_EQ(frame.stats.far_level, expected.stats.far_level);
      const bool is_of_one = mode == Mode::blocks || mode == Mode::minip || mode == Mode::attenuated_mip;
      EXPECT_EQ(frame.stats.far_level > 0, !is_of_one);
    }
  }
}

TEST_F(RecordWindowsTest, AWindowTakesTheRecordsInsideAlone) {
  Scene scene = makeScene(*makeSynthetic(kVolume), kSmallBlocks);
  PagesTest::start(scene.path, 1024 * kKib);
  View view = inside(scene.info, {0.1, 0.1, 0.1}, {-1, -1, -1});
  const Frame all = renderer_->render(*volume_, orderOf(view));
  ASSERT_TRUE(all.stats.paged);
  const std::uint64_t records = bytesOf("blocks");
  start(scene.path, 1024 * kKib);
  const Frame some = renderer_->render(*volume_, orderOf(view));
  EXPECT_EQ(some.pixels, all.pixels);
  EXPECT_LT(bytesOf("blocks"), records / 2);
}

// Every type, and channels that have windows of their own of one box.
TEST_F(RecordWindowsTest, EveryTypeAndSeveralChannels) {
  for (const VoxelType type : {VoxelType::u16, VoxelType::f32, VoxelType::rgba8, VoxelType::u8}) {
    SyntheticOptions options = kVolume;
    options.type = type;
    options.channels = type == VoxelType::rgba8 ? 1 : 2;
    Scene scene = makeScene(*makeSynthetic(options), kSmallBlocks);
    start(scene.path, 4096 * kKib);
    for (const Mode mode : {Mode::blend, Mode::mip}) {
      for (const Filter filter : {Filter::nearest, Filter::linear}) {
        View view = inside(scene.info, glm::dvec3(0.2, 0.3, 0.6), glm::dvec3(-0.3, -0.2, 1));
        view.mode = mode;
        view.filter = filter;
        SCOPED_TRACE(toString(view));
        const auto [expected, frame] = drawBoth(scene, view);
        EXPECT_TRUE(frame.stats.paged);
        EXPECT_EQ(frame.stats.absent_blocks, 0u);
        EXPECT_EQ(frame.pixels, expected.pixels);
      }
    }
  }
}

// Neither of all of a level nor of a large window; the index says how many there are.
TEST_F(RecordWindowsTest, WhatFindsNoRoomIsNotRead) {
  constexpr std::uint64_t kBudget = std::uint64_t{8} << 20;
  SyntheticOptions of_floats = kVolume;  // whose ranges take most of what there is of records
  of_floats.type = VoxelType::f32;
  Scene scene = makeScene(*makeSynthetic(of_floats), {.block_side = 1});
  DeviceOptions options;
  options.page_bytes = 1024 * kKib;
  options.record_bytes = 1;
  options.memory_budget_bytes = kBudget;
  OwnRendererTest::start(scene.path, options);
  const auto step = static_cast<VulkanVolume&>(*volume_).step(0);
  const LevelInfo& level = volume_->info().levels[0];
  const auto refused = [&](const View& view) {
    const std::uint64_t before = step->stored().file->bytesRead();
    const auto frame = renderer_->begin(*volume_, orderOf(view));
    try {
      while (frame->advance()) EXPECT_LE(renderer_->device().memory_used_bytes, kBudget);
      ADD_FAILURE() << "found room";
    } catch (const OutOfDeviceMemory& error) {
      EXPECT_EQ(error.field, "level");
    }
    EXPECT_LE(renderer_->device().memory_used_bytes, kBudget);
    return step->stored().file->bytesRead() - before;
  };
  View view = finest(32);
  EXPECT_LT(refused(view), level.apron_block_count);
  // To be counted, block records of 10 bytes are read, and no ranges, of 8 or 9 beside each.
  view.clip = ClipBox{.min = glm::dvec3(0), .max = glm::dvec3(300, 280, 200)};
  EXPECT_LT(refused(view), level.apron_block_count * 10);
  // A small one is drawn.
  view.clip = ClipBox{.min = glm::dvec3(40), .max = glm::dvec3(90)};
  const Frame frame = renderer_->render(*volume_, orderOf(view));
  EXPECT_EQ(frame.stats.level, 0);
  EXPECT_EQ(frame.pixels, renderer().render(*scene.resident, orderOf(view)).pixels);
}

// Another window's page is taken over as it lies, and goes from both when it gives way.
TEST_F(RecordWindowsTest, WindowsThatOverlapShareTheirPages) {
  Scene scene = makeScene(*makeSynthetic(kVolume), kSmallBlocks);
  View narrow = inside(scene.info, {0.2, 0.2, 0.2}, {-1, -0.1, -0.1});
  View wide = narrow;
  wide.fov_degrees = 100;
  start(scene.path, 8192 * kKib);
  const std::uint64_t alone = renderer_->render(*volume_, orderOf(wide)).stats.pages_read;
  start(scene.path, 8192 * kKib);
  const Frame first = renderer_->render(*volume_, orderOf(narrow));
  const Frame second = renderer_->render(*volume_, orderOf(wide));
  ASSERT_GT(partsOf("blocks"), 2u) << "one window each, and what stands in";
  EXPECT_GT(first.stats.pages_read, 0u);
  EXPECT_LE(second.stats.pages_read, alone - first.stats.pages_read / 2);
  EXPECT_EQ(second.pixels, renderer().render(*scene.resident, orderOf(wide)).pixels);
  // By turns, in less room than both need: what gives way is absent in both windows, and comes again.
  start(scene.path, 160 * kKib);
  for (int turn = 0; turn < 3; ++turn) {
    const auto [one, other] = drawByTurns(narrow, wide);
    EXPECT_EQ(one.pixels, renderer().render(*scene.resident, orderOf(narrow)).pixels);
    if (other.stats.absent_blocks > 0) continue;
    EXPECT_EQ(other.pixels, second.pixels);
  }
}

TEST_F(RecordWindowsTest, AnEmptyWindowShowsNothing) {
  const auto file = buildFile(*ball(200), kSmallBlocks);
  start(file, 256 * kKib);
  // A corner of the box, outside of the ball.
  View view = finest(32);
  view.eye = glm::dvec3(-30, -30, -30);
  view.target = glm::dvec3(-40, -40, -40);
  for (const Finder finder : {Finder::grid, Finder::octree, Finder::automatic, Finder::none}) {
    view.finder = finder;
    const Frame frame = renderer_->render(*volume_, orderOf(view));
    EXPECT_EQ(frame.stats.drawn_pixels, 0u);
  }
}

// Rays come to its part of the volume, and there is no block.
TEST_F(RecordWindowsTest, AWindowWithoutBlocksShowsNothing) {
  const auto file = buildFile(*ball(320), {.block_side = 1});
  start(file, 256 * kKib);
  View view = finest(32);
  view.clip = ClipBox{.min = glm::dvec3(2), .max = glm::dvec3(30)};
  for (const Combination& combination : everyFinder()) {
    for (const Filter filter : {Filter::nearest, Filter::linear}) {
      for (const Mode mode : {Mode::blend, Mode::mip, Mode::first_hit, Mode::blocks}) {
        view.filter = filter;
        view.mode = mode;
        SCOPED_TRACE(toString(combination));
        const Frame frame = renderer_->render(*volume_, orderOf(with(view, combination)));
        EXPECT_TRUE(frame.stats.paged);
        EXPECT_EQ(frame.stats.level, 0);
        EXPECT_EQ(frame.stats.drawn_pixels, 0u);
      }
    }
  }
}

}  // namespace
}  // namespace blockwalk::test
