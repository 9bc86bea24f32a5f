// SPDX-License-Identifier: Apache-2.0
// Refinement in steps: every step's picture is that of its samples drawn at once, and costs only the new ones, whoever
// else refines, and whatever becomes of the sums.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"

namespace blockwalk::test {
namespace {

class RefineTest : public OwnRendererTest {
 protected:
  void SetUp() override {
    path_ = buildFile(*makeSynthetic({.type = VoxelType::rgba8, .dims = {70, 64, 57}, .seed = 6}));
  }
  // With bands of three rows or so.
  void start(std::uint64_t kept_sum_bytes = DeviceOptions{}.kept_sum_bytes) {
    DeviceOptions options;
    options.band_ms = 0.2;
    options.kept_sum_bytes = kept_sum_bytes;
    OwnRendererTest::start(path_, options);
  }

  static View viewOf(double fov, int samples = 7, int width = 101) {
    View view;
    view.width = width;
    view.height = 75;
    view.fov_degrees = fov;
    view.samples = samples;
    view.background = {9, 8, 7, 40};
    return view;
  }

  Frame draw(const View& view) { return renderer_->render(*volume_, view, {}); }
  Frame step(const View& view, std::uint64_t owner, int begin, int end) {
    return renderer_->render(*volume_, view, {.step = SampleStep{.owner = owner, .begin = begin, .end = end}});
  }
  // The step drew as many samples as it says, and its picture is that of `end` samples drawn at once.
  void expectStep(const View& view, std::uint64_t owner, int begin, int end, int drawn) {
    const Frame frame = step(view, owner, begin, end);
    EXPECT_EQ(frame.samples_drawn, drawn) << begin << ".." << end;
    View whole = view;
    whole.samples = end;
    // One sample alone goes through the pixel's centre.
    if (end > 1) {
      EXPECT_EQ(frame.pixels, draw(whole).pixels) << begin << ".." << end;
    }
  }

  std::filesystem::path path_;
};

TEST_F(RefineTest, EveryStepIsWhatItsSamplesGiveAtOnceAndCostsOnlyTheNewOnes) {
  start();
  const View view = viewOf(40);
  expectStep(view, 1, 0, 1, 1);
  expectStep(view, 1, 1, 2, 1);
  expectStep(view, 1, 2, 4, 2);
  const Frame last = step(view, 1, 4, 7);
  EXPECT_EQ(last.samples_drawn, 3);
  const Frame whole = draw(view);
  EXPECT_EQ(last.pixels, whole.pixels);
  EXPECT_EQ(whole.samples_drawn, 7);
  EXPECT_EQ(last.stats.rays, whole.stats.rays);
  EXPECT_EQ(last.stats.voxel_steps, whole.stats.voxel_steps);
  EXPECT_EQ(last.stats.block_visits, whole.stats.block_visits);
  EXPECT_GT(last.stats.gpu_ms, 0);
}

TEST_F(RefineTest, OwnersDoNotDisturbEachOther) {
  start();
  const View narrow = viewOf(30), wide = viewOf(50, 5, 140);
  expectStep(narrow, 1, 0, 1, 1);
  expectStep(wide, 2, 0, 1, 1);
  draw(viewOf(45, 3, 200));  // of nobody
  expectStep(narrow, 1, 1, 2, 1);
  expectStep(wide, 2, 1, 2, 1);
  expectStep(wide, 2, 2, 5, 3);
  expectStep(narrow, 1, 2, 4, 2);
  expectStep(narrow, 1, 4, 7, 3);
}

TEST_F(RefineTest, SumsOfAnotherViewAreNeverUsed) {
  start();
  const View a = viewOf(30), b = viewOf(50);
  expectStep(a, 1, 0, 2, 2);
  expectStep(b, 1, 2, 4, 4);  // what is kept is of a
  expectStep(a, 1, 2, 4, 4);  // and now of b
  expectStep(a, 1, 0, 1, 1);  // a first step starts over
  expectStep(a, 1, 4, 5, 5);  // one sample is kept, not four
  expectStep(a, 1, 5, 7, 2);
  expectStep(a, 1, 5, 7, 7);  // all were shown: nothing is kept
}

TEST_F(RefineTest, WhatGaveWayStartsOver) {
  const View view = viewOf(30), other = viewOf(50);
  const std::uint64_t one = kSumBytes * 101 * 75;
  start(2 * one);
  expectStep(view, 1, 0, 2, 2);
  expectStep(other, 2, 0, 2, 2);
  expectStep(view, 1, 2, 3, 1);   // both fit
  expectStep(other, 3, 0, 1, 1);  // in place of 2, which was used longest ago
  expectStep(view, 1, 3, 4, 1);
  expectStep(other, 2, 2, 4, 4);
  start(one - 1);  // none fits
  expectStep(view, 1, 0, 2, 2);
  expectStep(view, 1, 2, 4, 4);
}

TEST_F(RefineTest, WhatIsKeptIsBounded) {
  start();
  draw(viewOf(40));
  const std::uint64_t before = renderer_->device().memory_used_bytes;
  const std::uint64_t one = kSumBytes * 101 * 75;
  step(viewOf(40), 1, 0, 2);
  EXPECT_GE(renderer_->device().memory_used_bytes, before + one);
  step(viewOf(40), 1, 2, 7);
  EXPECT_EQ(renderer_->device().memory_used_bytes, before) << "given back with the last step";
  start(3 * one);
  draw(viewOf(40));
  const std::uint64_t empty = renderer_->device().memory_used_bytes;
  for (std::uint64_t owner = 1; owner < 20; ++owner) step(viewOf(40), owner, 0, 2);
  EXPECT_LE(renderer_->device().memory_used_bytes, empty + 4 * one) << "alignment takes a little";
}

TEST_F(RefineTest, AStepCancelledWhileItDrawsLeavesNoSums) {
  start();
  View view = viewOf(40);
  view.width = view.height = 300;
  expectStep(view, 1, 0, 2, 2);
  const auto cancel = std::make_shared<std::atomic<bool>>(false);
  FrameOrder order{.view = resolveView(view, volume_->info()),
                   .cancel = cancel,
                   .step = SampleStep{.owner = 1, .begin = 2, .end = 4}};
  const std::unique_ptr<FrameInProgress> frame = renderer_->begin(*volume_, std::move(order));
  ASSERT_TRUE(frame->advance());
  *cancel = true;
  EXPECT_FALSE(frame->advance());
  EXPECT_TRUE(frame->finish().cancelled);
  expectStep(view, 1, 2, 4, 4);
}

TEST_F(RefineTest, AStepCancelledBeforeItDrawsLeavesTheSumsAsTheyWere) {
  start();
  View view = viewOf(40);
  expectStep(view, 1, 0, 2, 2);
  const auto cancel = std::make_shared<std::atomic<bool>>(true);
  const Frame cancelled =
      renderer_->render(*volume_, view, {.cancel = cancel, .step = SampleStep{.owner = 1, .begin = 2, .end = 4}});
  EXPECT_TRUE(cancelled.cancelled);
  expectStep(view, 1, 2, 4, 2);
}

TEST_F(RefineTest, WhoeverIsForgottenLeavesNothing) {
  start();
  const View view = viewOf(40);
  const std::uint64_t before = renderer_->device().memory_used_bytes;
  expectStep(view, 1, 0, 2, 2);
  expectStep(view, 2, 0, 2, 2);
  const auto sums = [&] {
    const std::vector<PartTotal> totals = renderer_->parts();
    return std::ranges::find(totals, "sums", &PartTotal::what)->count;
  };
  EXPECT_EQ(sums(), 2u);
  const std::uint64_t used = renderer_->device().memory_used_bytes;
  EXPECT_GT(used, before);
  renderer_->forget(1);
  EXPECT_EQ(sums(), 1u);
  EXPECT_LE(renderer_->device().memory_used_bytes, used - kSumBytes * 101 * 75);
  expectStep(view, 1, 2, 4, 4);
  expectStep(view, 2, 2, 4, 2);
}

using RefineDeathTest = RefineTest;

TEST_F(RefineDeathTest, StepsThatAreNoneAreAProgrammersError) {
  start();
  const View view = viewOf(40);
  for (const auto& [begin, end] : {std::pair{-1, 2}, {2, 2}, {3, 2}, {2, 8}}) {
    EXPECT_DEATH(step(view, 1, begin, end), "check failed") << begin << ".." << end;
  }
}

}  // namespace
}  // namespace blockwalk::test
