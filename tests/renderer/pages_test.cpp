// SPDX-License-Identifier: Apache-2.0
// Voxels that come and go: whatever the room for them, a picture that is waited for is that of all voxels, bit for bit;
// and one that is not is nowhere empty where that is not.
#include <gtest/gtest.h>

#include "renderer/resident/pages.h"
#include "tests/renderer/pages_stage.h"
#include "tests/renderer/synthetic.h"
#include "tests/renderer/views.h"

namespace blockwalk::test {
namespace {

struct PagedCase {
  const char* name;
  SyntheticOptions volume;
  std::uint64_t page_bytes;  // less than a level's voxels, more than the blocks along some rays
};

void PrintTo(const PagedCase& paged, std::ostream* out) { *out << paged.name; }

class PagedTest : public PagesTest, public ::testing::WithParamInterface<PagedCase> {};

TEST_P(PagedTest, WhatIsWaitedForIsThatOfAllVoxels) {
  Scene scene = makeScene(*makeSynthetic(GetParam().volume), kSmallBlocks);
  start(scene.path, GetParam().page_bytes);
  const bool tries_all = GetParam().volume.type == VoxelType::u8;
  const std::vector<Combination> finders = tries_all ? everyFinder() : std::vector{Combination{.finder = Finder::grid}};
  std::uint64_t read = 0;
  std::size_t number = 0;
  int whole = 0;
  for (View view : randomViews(scene.info, scene.dense(0), 11)) {
    view.filter = number % 3 == 0 ? Filter::nearest : Filter::linear;
    view.lit = number % 5 == 0;
    view.samples = number % 4 == 0 ? 3 : 1;
    view = with(view, finders[number++ % finders.size()]);
    SCOPED_TRACE(toString(view));
    const auto [expected, frame] = drawBoth(scene, view);
    read += frame.stats.pages_read;
    if (frame.stats.absent_blocks > 0) continue;  // from far away a few rays see more than there is room for
    ++whole;
    EXPECT_EQ(frame.pixels, expected.pixels);
    EXPECT_EQ(frame.stats.voxel_steps, expected.stats.voxel_steps) << "what was drawn before does not count";
  }
  EXPECT_GE(whole, kViewCount / 2);
  EXPECT_GT(read, scene.info.levels[0].block_count) << "pages gave way and came again";
}

TEST_F(PagesTest, EveryModeIsThatOfAllVoxels) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::u8, .dims = {200, 190, 180}, .seed = 4}), kSmallBlocks);
  start(scene.path, 4096 * kKib);
  for (const Mode mode : {Mode::blend, Mode::first_hit, Mode::mip, Mode::minip, Mode::attenuated_mip, Mode::mean,
                          Mode::iso, Mode::blocks}) {
    for (const Filter filter : {Filter::nearest, Filter::linear}) {
      for (const Output output : {Output::color, Output::depth}) {
        if (output == Output::depth && (mode == Mode::blocks || mode == Mode::mean)) continue;
        View view = finest(96);
        view.mode = mode;
        view.filter = filter;
        view.output = output;
        SCOPED_TRACE(toString(view));
        const auto [expected, frame] = drawBoth(scene, view);
        EXPECT_EQ(frame.pixels, expected.pixels);
        EXPECT_EQ(frame.values, expected.values);
        EXPECT_EQ(frame.stats.absent_blocks, 0u);
      }
    }
  }
}

TEST_P(PagedTest, TheRoomForVoxelsIsKept) {
  const auto file = buildFile(*makeSynthetic(GetParam().volume), kSmallBlocks);
  start(file, GetParam().page_bytes);
  std::uint64_t on_host = 0;
  for (const LevelInfo& level : volume_->info().levels) on_host += PagedVoxels::hostBytes(level.apron_block_count);
  View view = finest(40);
  view.filter = Filter::linear;
  const auto frame = renderer_->begin(*volume_, orderOf(view));
  for (bool more = true; more;) {
    more = frame->advance();
    // The coarser level takes a quarter, or what the coarsest takes.
    EXPECT_LE(bytesOf("voxels"),
              GetParam().page_bytes + std::max<std::uint64_t>(GetParam().page_bytes / 4, 512 * kKib) + on_host);
  }
  EXPECT_EQ(frame->finish().stats.absent_blocks, 0u);
}

INSTANTIATE_TEST_SUITE_P(
    Types, PagedTest,
    ::testing::Values(
        PagedCase{"u8", {.type = VoxelType::u8, .dims = {200, 190, 180}, .seed = 4}, 4096 * kKib},
        PagedCase{"u16", {.type = VoxelType::u16, .dims = {110, 120, 130}, .seed = 5, .channels = 2}, 8192 * kKib},
        PagedCase{"f32", {.type = VoxelType::f32, .dims = {120, 110, 100}, .seed = 6}, 6144 * kKib},
        PagedCase{"rgba8", {.type = VoxelType::rgba8, .dims = {100, 120, 110}, .seed = 7}, 6144 * kKib}),
    [](const auto& test) { return std::string(test.param.name); });

TEST_F(PagesTest, WhatIsNotWaitedForIsCoarserThereAndNowhereEmpty) {
  Scene scene = makeScene(*ball(200), kSmallBlocks);
  start(scene.path, 1024 * kKib);
  View view = finest(64);
  view.channels[0].transfer = {{.value = 0, .color = {0, 0, 0}, .opacity = 0},
                               {.value = 255, .color = {1, 1, 1}, .opacity = 0.5}};
  for (const Filter filter : {Filter::nearest, Filter::linear}) {
    view.filter = filter;
    SCOPED_TRACE(toString(view));
    const Frame complete = renderer().render(*scene.resident, view);
    const Frame first = drawAsItIs(view);
    EXPECT_GT(first.stats.absent_blocks, 0u);
    std::size_t shown = 0;
    for (std::size_t i = 0; i < complete.pixels.size(); ++i) {
      if ((complete.pixels[i] & 0xffffff) == 0) continue;
      ++shown;
      EXPECT_NE(first.pixels[i] & 0xffffff, 0u) << i;
    }
    EXPECT_GT(shown, 500u);
  }
}

// Hairs one voxel thick fade in means, and are nothing but thicker in maxima.
TEST_F(PagesTest, NothingIsMissedWhereMaximaStandIn) {
  Scene scene = makeScene(*makeVoxels(glm::ivec3(160),
                                      [](glm::ivec3 p) {
                                        const glm::ivec3 at = p % 10;
                                        return at.x == 3 && at.y == 4 ? 160 + (7 * p.x + 3 * p.y + 11 * p.z) % 90 : 0;
                                      }),
                          kSmallBlocks);
  const auto missed = [&](Mode mode, Filter filter, StandIn stand_in) {
    start(scene.path, 640 * kKib);
    View view = finest(64);
    view.mode = mode;
    view.filter = filter;
    view.stand_in = stand_in;
    if (mode == Mode::iso) view.iso = 180;
    view.channels[0].range = DensityRange{.lo = 180, .hi = 255};
    view.channels[0].transfer = {{.value = 180, .color = {1, 1, 1}, .opacity = 1}};
    const Frame complete = renderer().render(*scene.resident, view);
    const Frame first = drawAsItIs(view);
    EXPECT_GT(first.stats.absent_blocks, 0u);
    std::size_t shown = 0, holes = 0;
    for (std::size_t i = 0; i < complete.pixels.size(); ++i) {
      if ((complete.pixels[i] & 0xffffff) == 0) continue;
      ++shown;
      holes += (first.pixels[i] & 0xffffff) == 0 ? 1 : 0;
    }
    EXPECT_GT(shown, 100u);
    return static_cast<double>(holes) / static_cast<double>(shown);
  };
  for (const Filter filter : {Filter::nearest, Filter::linear}) {
    const double most = filter == Filter::nearest ? 0 : 0.15;  // interpolated with nothing, the rim of a voxel fades
    EXPECT_EQ(missed(Mode::blend, filter, StandIn::automatic), 1);
    EXPECT_LE(missed(Mode::blend, filter, StandIn::maximum), most);
    EXPECT_EQ(missed(Mode::first_hit, filter, StandIn::mean), 1);
    for (const Mode mode : {Mode::first_hit, Mode::iso}) EXPECT_LE(missed(mode, filter, StandIn::automatic), most);
  }
}

TEST_F(PagesTest, WhatIsNotWaitedForComesMeanwhile) {
  Scene scene = makeScene(*ball(120), kSmallBlocks);
  start(scene.path, 640 * kKib);  // all of it takes more; what is seen of its surface fits
  View view = finest(64);
  view.channels[0].transfer = {{.value = 100, .color = {1, 1, 1}, .opacity = 1}};
  const Frame complete = renderer().render(*scene.resident, view);
  Frame frame = drawAsItIs(view);
  EXPECT_GT(frame.stats.absent_blocks, 0u);
  for (int i = 0; i < 10000 && frame.stats.absent_blocks > 0; ++i) frame = drawAsItIs(view);
  EXPECT_EQ(frame.stats.absent_blocks, 0u);
  EXPECT_EQ(frame.pixels, complete.pixels);
}

// Where what is seen takes more than there is room for, nothing comes and goes for ever.
TEST_F(PagesTest, WhatIsNotWaitedForDoesNotFlicker) {
  Scene scene = makeScene(*ball(200), kSmallBlocks);
  start(scene.path, 1024 * kKib);
  View view = finest(300);  // of several bands
  view.filter = Filter::linear;
  view.channels[0].transfer = {{.value = 0, .color = {0, 0, 0}, .opacity = 0},
                               {.value = 255, .color = {1, 1, 1}, .opacity = 0.02}};
  Frame frame = drawAsItIs(view);
  int still = 0;  // frames that brought nothing
  for (int i = 0; i < 600 && still < 50; ++i) {
    Frame next = drawAsItIs(view);
    still = next.stats.pages_read == 0 && next.pixels == frame.pixels ? still + 1 : 0;
    frame = std::move(next);
  }
  EXPECT_EQ(still, 50);
  EXPECT_GT(frame.stats.absent_blocks, 0u);
  EXPECT_GT(bytesOf("voxels"), 512 * kKib);
}

TEST_F(PagesTest, RefinementInStepsIsThatOfAllVoxels) {
  Scene scene = makeScene(*ball(150), kSmallBlocks);
  start(scene.path, 1024 * kKib);
  View view = finest(48);
  view.samples = 7;
  const Frame expected = renderer().render(*scene.resident, view);
  Frame frame;
  for (const auto& [begin, end] : {std::pair(0, 1), {1, 2}, {2, 4}, {4, 7}}) {
    FrameOrder order = orderOf(view);
    order.step = SampleStep{.owner = 3, .begin = begin, .end = end};
    frame = renderer_->render(*volume_, std::move(order));
    EXPECT_EQ(frame.samples_drawn, end - begin);
  }
  EXPECT_EQ(frame.pixels, expected.pixels);
}

// Where not even the blocks along some rays fit the picture is coarser there, and that is said.
TEST_F(PagesTest, WithTooLittleRoomThePictureEndsAndSaysSo) {
  Scene scene = makeScene(*ball(200), kSmallBlocks);
  start(scene.path, 64 * kKib);
  View view = finest(40);
  view.filter = Filter::linear;
  for (const int samples : {1, 5}) {
    view.samples = samples;
    const Frame frame = renderer_->render(*volume_, view);
    EXPECT_GT(frame.stats.absent_blocks, 0u);
    EXPECT_FALSE(frame.cancelled);
    EXPECT_EQ(frame.pixels.size(), 1600u);
  }
}

// Bands by turns, at two places of one pool.
TEST_F(PagesTest, TwoWhoLookAtOnceBothGetAllVoxels) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::u8, .dims = {200, 190, 180}, .seed = 4}), kSmallBlocks);
  start(scene.path, 4096 * kKib);
  View near = finest(48);
  View far = finest(48);
  near.filter = Filter::linear;
  near.eye = glm::dvec3(75, 70, 400);
  near.target = glm::dvec3(75, 70, 0);
  far.eye = glm::dvec3(-300, 70, 65);
  far.target = glm::dvec3(75, 70, 65);
  const Frame expected_near = renderer().render(*scene.resident, near);
  const Frame expected_far = renderer().render(*scene.resident, far);
  const auto [first, second] = drawByTurns(near, far);
  EXPECT_EQ(first.stats.absent_blocks, 0u);
  EXPECT_EQ(second.stats.absent_blocks, 0u);
  EXPECT_EQ(first.pixels, expected_near.pixels);
  EXPECT_EQ(second.pixels, expected_far.pixels);
}

// Of one volume, and one of them with more along a workgroup's rays than there is room for: that is its own trouble.
TEST_F(PagesTest, WhoHasTooLittleRoomDoesNotMakeOthersCoarser) {
  Scene scene = makeScene(*ball(200), kSmallBlocks);
  start(scene.path, 1024 * kKib);
  View far = finest(8);
  far.filter = Filter::linear;
  far.channels[0].transfer = {{.value = 0, .color = {0, 0, 0}, .opacity = 0},
                              {.value = 255, .color = {1, 1, 1}, .opacity = 0.001}};
  View near = far;
  near.width = near.height = 48;
  near.eye = glm::dvec3(100, 110, 184);  // inside
  near.target = glm::dvec3(100, 100, 210);
  const Frame expected = renderer().render(*scene.resident, near);
  for (int round = 0; round < 4; ++round) {
    const auto [coarse, frame] = drawByTurns(far, near);
    EXPECT_FALSE(coarse.stats.isComplete());
    EXPECT_TRUE(frame.stats.isComplete());
    EXPECT_EQ(frame.pixels, expected.pixels);
  }
}

// What rays come to fits, the level does not.
TEST_F(PagesTest, WhatFitsIsReadOnce) {
  Scene scene = makeScene(*ball(200), kSmallBlocks);
  start(scene.path, 6144 * kKib);
  View view = finest(96);
  view.filter = Filter::linear;
  view.clip = ClipBox{{0, 0, 0}, {200, 200, 70}};
  const Frame expected = renderer().render(*scene.resident, view);
  const Frame first = renderer_->render(*volume_, view);
  EXPECT_EQ(first.pixels, expected.pixels);
  EXPECT_TRUE(first.stats.paged);
  EXPECT_TRUE(first.stats.isComplete());
  EXPECT_GT(first.stats.pages_read, 0u);
  EXPECT_LE(bytesOf("voxels"), 6144 * kKib * 9 / 8);
  const Frame second = renderer_->render(*volume_, view);
  EXPECT_EQ(second.pixels, expected.pixels);
  EXPECT_EQ(second.stats.pages_read, 0u);
}

// Of a picture that shows more than there is room for most is there when it is drawn again: what one begins with does
// not give way to what it ends with.
TEST_F(PagesTest, WhatDoesNotFitIsNotAllReadAgain) {
  Scene scene = makeScene(*ball(200), kSmallBlocks);
  View view = finest(96);
  view.filter = Filter::linear;
  view.channels[0].transfer = {{.value = 0, .color = {0, 0, 0}, .opacity = 0},
                               {.value = 255, .color = {1, 1, 1}, .opacity = 0.02}};
  const Frame expected = renderer().render(*scene.resident, view);
  start(scene.path, 64 * 1024 * kKib);
  renderer_->render(*volume_, view);
  const std::uint64_t all = bytesOf("voxels");
  start(scene.path, all * 3 / 4);
  const Frame first = renderer_->render(*volume_, view);
  EXPECT_TRUE(first.stats.paged);
  for (int again = 0; again < 3; ++again) {
    const Frame frame = renderer_->render(*volume_, view);
    EXPECT_EQ(frame.pixels, expected.pixels);
    EXPECT_EQ(frame.stats.absent_blocks, 0u);
    EXPECT_GT(frame.stats.pages_read, 0u);
    EXPECT_LT(frame.stats.pages_read, first.stats.pages_read * 7 / 10);
  }
  // A refinement too.
  view.samples = 4;
  for (int step = 0; step < 4; ++step) {
    FrameOrder order = orderOf(view);
    order.step = SampleStep{.owner = 3, .begin = step, .end = step + 1};
    const Frame frame = renderer_->render(*volume_, std::move(order));
    EXPECT_LT(frame.stats.pages_read, first.stats.pages_read * 3 / 4) << step;
  }
}

TEST_F(PagesTest, AFrameThatIsGivenUpHoldsNothing) {
  const auto file = buildFile(*ball(150), kSmallBlocks);
  start(file, 1024 * kKib);
  View view = finest(48);
  for (int pieces = 1; pieces < 12; ++pieces) {
    const auto frame = renderer_->begin(*volume_, orderOf(view));
    for (int i = 0; i < pieces && frame->advance(); ++i) {
    }
  }
  const Frame whole = renderer_->render(*volume_, view);
  EXPECT_EQ(whole.stats.absent_blocks, 0u);
}

}  // namespace
}  // namespace blockwalk::test
