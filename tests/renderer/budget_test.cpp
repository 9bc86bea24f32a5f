// SPDX-License-Identifier: Apache-2.0
// Memory: what is shared by many who look, what gives way, what is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"

namespace blockwalk::test {
namespace {

class BudgetTest : public OwnRendererTest {
 protected:
  void start(const std::filesystem::path& file, std::uint64_t budget, bool probes = false) {
    DeviceOptions options;
    options.memory_budget_bytes = budget;
    options.page_bytes = 0;  // what does not fit as a whole is refused
    options.probe_software = probes;
    OwnRendererTest::start(file, options);
  }

  std::uint64_t used() const { return renderer_->device().memory_used_bytes; }

  // After every piece no more is held than may be.
  Frame drawWithin(const View& view, std::uint64_t budget) {
    const auto frame = renderer_->begin(*volume_, {.view = resolveView(view, volume_->info())});
    for (bool more = true; more;) {
      more = frame->advance();
      EXPECT_LE(used(), budget);
    }
    return frame->finish();
  }

  std::map<std::string, std::uint64_t> made() const {
    std::map<std::string, std::uint64_t> counts;
    for (const PartTotal& total : renderer_->parts()) counts[total.what] = total.made;
    return counts;
  }
};

TEST_F(BudgetTest, ManyWhoLookDoNotDriveOutEachOthersParts) {
  start(buildFile(*makeSynthetic({.type = VoxelType::u8, .dims = {90, 80, 70}, .seed = 4})), 0);
  const auto round = [&] {
    for (int session = 0; session < 5; ++session) {
      View view;
      view.width = view.height = 40;
      view.mode = Mode::mip;
      view.channels[0].range = DensityRange{10.0 + 30 * session, 230};
      view.channels[0].transfer_preset = session % 2 == 0 ? TransferPreset::viridis : TransferPreset::grey;
      if (session == 4 && renderer_->device().ray_query) view.finder = Finder::boundary;
      renderer_->render(*volume_, view, {});
    }
  };
  round();
  const auto first = made();
  EXPECT_EQ(first.at("quarters"), 5u);
  EXPECT_EQ(first.at("table"), 5u);
  for (int i = 0; i < 3; ++i) round();
  EXPECT_EQ(made(), first);
}

// Each with a range of his own, of which boxes and boundaries are made.
TEST_F(BudgetTest, ManyWhoLookDoNotDriveOutEachOthersRegions) {
  if (!renderer().device().ray_query) GTEST_SKIP() << "this device has no ray queries";
  start(buildFile(*makeSynthetic({.type = VoxelType::u8, .dims = {60, 50, 40}, .seed = 4})), 0);
  const auto round = [&] {
    for (const Finder finder : {Finder::clusters, Finder::boundary}) {
      for (int session = 0; session < 5; ++session) {
        View view;
        view.width = view.height = 16;
        view.mode = Mode::mip;
        view.finder = finder;
        view.channels[0].range = DensityRange{10.0 + 30 * session, 230};
        renderer_->render(*volume_, view, {});
      }
    }
  };
  round();
  const auto first = made();
  EXPECT_EQ(first.at("clusters"), 5u);
  EXPECT_EQ(first.at("boundary"), 5u);
  round();
  EXPECT_EQ(made(), first);
}

TEST_F(BudgetTest, WalkingEverythingStaysWithinItAndIsRight) {
  const auto file =
      buildFile(*makeSynthetic({.type = VoxelType::u16, .dims = {120, 100, 80}, .seed = 5, .channels = 2}));
  std::vector<View> views;
  std::vector<Finder> finders{Finder::grid, Finder::octree};
  if (renderer().device().ray_query) finders.insert(finders.end(), {Finder::query, Finder::clusters});
  for (int level : {0, 1}) {
    for (Filter filter : {Filter::nearest, Filter::linear}) {
      for (Finder finder : finders) {
        for (const std::vector<int>& drawn : {std::vector<int>{0}, {0, 1}}) {
          View view;
          view.width = view.height = 32;
          view.level = level;
          view.filter = filter;
          view.finder = finder;
          view.drawn = drawn;
          views.push_back(view);
        }
      }
    }
  }
  start(file, 0);
  std::vector<Frame> expected;
  for (const View& view : views) expected.push_back(renderer_->render(*volume_, view, {}));
  const std::uint64_t everything = used();
  const auto made_once = made();
  const std::uint64_t budget = everything * 2 / 3;
  start(file, budget);
  for (int round = 0; round < 2; ++round) {
    for (std::size_t i = 0; i < views.size(); ++i) {
      EXPECT_EQ(drawWithin(views[i], budget).pixels, expected[i].pixels) << i;
    }
  }
  EXPECT_GT(made().at("voxels"), made_once.at("voxels")) << "some had to give way";
}

TEST_F(BudgetTest, WhatDoesNotFitIsRefusedAndWhatDoesIsServed) {
  const auto file = buildFile(*makeSynthetic({.type = VoxelType::f32, .dims = {120, 110, 100}, .seed = 5}));
  View fine, coarse;
  fine.width = fine.height = coarse.width = coarse.height = 24;
  fine.level = 0;
  coarse.level = 1;
  start(file, 0);
  const Frame expected = renderer_->render(*volume_, coarse, {});
  const std::uint64_t budget = used() + (std::uint64_t{64} << 10);
  ASSERT_GT(volume_->info().levels[0].voxel_bytes, budget);
  start(file, budget);
  for (int round = 0; round < 2; ++round) {
    EXPECT_EQ(drawWithin(coarse, budget).pixels, expected.pixels);
    try {
      drawWithin(fine, budget);
      ADD_FAILURE() << "it cannot fit";
    } catch (const OutOfDeviceMemory& error) {
      EXPECT_GE(error.needed_bytes, volume_->info().levels[0].voxel_bytes);
      EXPECT_LT(error.free_bytes, error.needed_bytes);
      EXPECT_LE(error.free_bytes, budget);
      EXPECT_EQ(error.field, "level");
      EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr(fmt::format("{} bytes", error.needed_bytes)),
                                               testing::HasSubstr("a coarser level needs less")));
    }
  }
}

// A frame under way keeps what it uses: who needs more than is left beside it waits, and holds nothing meanwhile.
TEST_F(BudgetTest, WhoFindsNoRoomBesideOthersWaitsUntilOneHasEnded) {
  const auto file = buildFile(*makeSynthetic({.type = VoxelType::u16, .dims = {120, 110, 100}, .seed = 5}));
  View view, other;
  view.width = other.width = 32;
  view.height = other.height = 200;
  view.level = other.level = 0;
  other.filter = Filter::linear;
  start(file, 0);
  const Frame expected = renderer_->render(*volume_, view, {});
  const Frame expected_other = renderer_->render(*volume_, other, {});
  const std::uint64_t budget = used() * 3 / 4;
  start(file, budget);
  const auto begin = [&](const View& of) {
    return renderer_->begin(*volume_, {.view = resolveView(of, volume_->info())});
  };
  const auto frame = begin(view);
  while (renderer_->parts()[0].made == 0) ASSERT_TRUE(frame->advance());    // it has its voxels
  EXPECT_THROW(renderer_->render(*volume_, other, {}), OutOfDeviceMemory);  // which does not wait

  std::vector<std::unique_ptr<FrameInProgress>> waiting;
  for (int i = 0; i < 3; ++i) {
    waiting.push_back(begin(other));
    while (!waiting.back()->waits()) ASSERT_TRUE(waiting.back()->advance());
    EXPECT_LE(used(), budget);
  }
  EXPECT_THROW(waiting[2]->advance(), OutOfDeviceMemory);  // who asks now is refused
  waiting.pop_back();
  while (frame->advance()) EXPECT_TRUE(waiting[0]->waits());
  EXPECT_EQ(frame->finish().pixels, expected.pixels);
  for (const auto& late : waiting) {
    EXPECT_FALSE(late->waits());
    while (late->advance()) EXPECT_LE(used(), budget);
    EXPECT_EQ(late->finish().pixels, expected_other.pixels);
  }
}

// Two that each fit alone, in turns: the second gives way whatever it had, and neither is refused.
TEST_F(BudgetTest, FramesThatFitOnlyOneAfterTheOtherAllEnd) {
  const auto file = buildFile(*makeSynthetic({.type = VoxelType::u16, .dims = {120, 110, 100}, .seed = 5}));
  std::vector<View> views(4);
  for (std::size_t i = 0; i < views.size(); ++i) {
    views[i].width = views[i].height = 48;
    views[i].level = 0;
    views[i].filter = i % 2 == 0 ? Filter::linear : Filter::nearest;
    views[i].channels[0].range = DensityRange{10.0 + static_cast<double>(i), 60000};
  }
  start(file, 0);
  std::vector<Frame> expected;
  std::uint64_t most = 0;
  for (const View& view : views) {
    start(file, 0);
    expected.push_back(renderer_->render(*volume_, view, {}));
    most = std::max(most, used());
  }
  const std::uint64_t budget = most + (std::uint64_t{256} << 10);
  start(file, budget);
  std::vector<std::unique_ptr<FrameInProgress>> frames;
  for (const View& view : views)
    frames.push_back(renderer_->begin(*volume_, {.view = resolveView(view, volume_->info())}));
  std::vector<bool> done(frames.size());
  bool any_waited = false;
  for (int turn = 0; std::ranges::find(done, false) != done.end(); ++turn) {
    ASSERT_LT(turn, 100000);
    bool moved = false;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      any_waited = any_waited || (!done[i] && frames[i]->waits());
      if (done[i] || frames[i]->waits()) continue;
      moved = true;
      done[i] = !frames[i]->advance();
      EXPECT_LE(used(), budget);
    }
    ASSERT_TRUE(moved) << "all wait for each other";
  }
  EXPECT_TRUE(any_waited);
  for (std::size_t i = 0; i < frames.size(); ++i) EXPECT_EQ(frames[i]->finish().pixels, expected[i].pixels) << i;
}

// Buffers are of a band, not of the picture, whatever the samples.
TEST_F(BudgetTest, ALargePictureOfManySamplesTakesLittleOfTheDevice) {
  constexpr std::uint64_t kBudget = std::uint64_t{32} << 20;
  start(buildFile(*makeSynthetic({.type = VoxelType::u8, .dims = {60, 50, 40}, .seed = 4})), kBudget);
  View view;
  view.width = view.height = 2048;
  view.samples = 2;
  const Frame frame = drawWithin(view, kBudget);
  EXPECT_GT(std::ranges::count_if(frame.pixels, [&](std::uint32_t p) { return p != frame.pixels[0]; }), 10000);
}

// It is refused at once, beside whom it may be, and nothing gives way for it.
TEST_F(BudgetTest, WhatCanNeverFitNeitherWaitsNorDrivesAnythingOut) {
  const auto file = buildFile(*makeSynthetic({.type = VoxelType::f32, .dims = {120, 110, 100}, .seed = 5}));
  View fine, coarse;
  fine.width = fine.height = coarse.width = coarse.height = 24;
  fine.level = 0;
  coarse.level = 1;
  coarse.height = 3000;  // many bands
  start(file, 0);
  renderer_->render(*volume_, coarse, {});
  start(file, used() + (std::uint64_t{64} << 10));
  renderer_->render(*volume_, coarse, {});
  const auto once = made();
  const auto holder = renderer_->begin(*volume_, {.view = resolveView(coarse, volume_->info())});
  ASSERT_TRUE(holder->advance());
  const auto frame = renderer_->begin(*volume_, {.view = resolveView(fine, volume_->info())});
  EXPECT_THROW(
      {
        while (frame->advance()) ASSERT_FALSE(frame->waits());
      },
      OutOfDeviceMemory);
  while (holder->advance()) {
  }
  renderer_->render(*volume_, coarse, {});
  EXPECT_EQ(made(), once);
}

TEST_F(BudgetTest, WhereTheInstancesDoNotFitTheGridServesAndNothingIsTriedAgain) {
  if (!renderer().device().ray_query) GTEST_SKIP() << "this device has no ray queries";
  BuildOptions small_blocks;
  small_blocks.subblock_side = 4;
  small_blocks.block_side = 1;
  const auto file = buildFile(*makeSynthetic({.type = VoxelType::u8, .dims = {90, 80, 70}, .seed = 4}), small_blocks);
  View view;
  view.width = view.height = 48;
  view.level = 0;
  view.finder = Finder::grid;
  start(file, 0);
  const Frame expected = renderer_->render(*volume_, view, {});
  start(file, used() + (std::uint64_t{32} << 10), true);
  view.finder = Finder::automatic;
  const Frame frame = renderer_->render(*volume_, view, {});
  EXPECT_EQ(frame.pixels, expected.pixels);
  EXPECT_EQ(frame.stats.finder, "grid");
  EXPECT_EQ(notes_.size(), 1u);
  const auto once = made();
  EXPECT_EQ(renderer_->render(*volume_, view, {}).pixels, expected.pixels);
  EXPECT_EQ(notes_.size(), 1u);
  EXPECT_EQ(made(), once);
}

}  // namespace
}  // namespace blockwalk::test
