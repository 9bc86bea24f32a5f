// SPDX-License-Identifier: Apache-2.0
// Voxels that come and go are brought in before they are looked at, in room that nobody used of late.
#include <gtest/gtest.h>

#include "tests/renderer/pages_stage.h"

namespace blockwalk::test {
namespace {

class AheadTest : public PagesTest {
 protected:
  Frame bringAhead(const View& view, std::shared_ptr<std::atomic<bool>> cancel = {}) {
    FrameOrder order = orderOf(view);
    order.count = false;
    order.ahead = true;
    order.cancel = std::move(cancel);
    return renderer_->render(*volume_, std::move(order));
  }
  // Until it lacks nothing, or no more comes.
  Frame look(const View& view) {
    Frame frame = drawAsItIs(view);
    for (int i = 0; i < 2000 && frame.stats.absent_blocks > 0; ++i) frame = drawAsItIs(view);
    return frame;
  }
  // Of an opaque ball, from one side or the other.
  static View from(double side) {
    View view = finest(64);
    view.eye = glm::dvec3(100 + side, 100, 100);
    view.target = glm::dvec3(100);
    view.channels[0].transfer = {{.value = 100, .color = {1, 1, 1}, .opacity = 1}};
    return view;
  }
};

TEST_F(AheadTest, WhatMayComeIsThereWhenItComes) {
  Scene scene = makeScene(*ball(200), kSmallBlocks);
  start(scene.path, 3328 * kKib);  // less than all of it
  EXPECT_EQ(look(from(500)).stats.absent_blocks, 0u);
  const std::uint64_t before = bytesOf("voxels");
  const Frame brought = bringAhead(from(-500));
  EXPECT_GT(brought.stats.pages_read, 0u);
  EXPECT_EQ(brought.stats.foreseen_pages, 0u);
  EXPECT_GT(bytesOf("voxels"), before);
  // What was shown has not given way.
  const Frame again = drawAsItIs(from(500));
  EXPECT_EQ(again.stats.absent_blocks, 0u);
  EXPECT_EQ(again.stats.foreseen_pages, 0u);
  const Frame expected = renderer().render(*scene.resident, from(-500));
  const Frame first = drawAsItIs(from(-500));
  EXPECT_LE(first.stats.absent_blocks, first.stats.wanted_blocks / 8) << "every second ray has looked";
  EXPECT_GE(first.stats.foreseen_pages, brought.stats.pages_read * 9 / 10);
  EXPECT_LE(first.stats.foreseen_pages, brought.stats.pages_read);
  EXPECT_EQ(drawAsItIs(from(-500)).stats.foreseen_pages, 0u) << "a page is foreseen once";
  EXPECT_EQ(look(from(-500)).pixels, expected.pixels);
}

TEST_F(AheadTest, WhatWasLookedAtOfLateDoesNotGiveWay) {
  Scene scene = makeScene(*ball(200), kSmallBlocks);
  start(scene.path, 1536 * kKib);  // one side and no more
  const Frame shown = look(from(500));
  ASSERT_EQ(shown.stats.absent_blocks, 0u);
  for (int i = 0; i < 3; ++i) bringAhead(from(-500));
  const Frame again = drawAsItIs(from(500));
  EXPECT_EQ(again.stats.absent_blocks, 0u);
  EXPECT_EQ(again.pixels, shown.pixels);
  // Who waits for its picture has all the room that it needs.
  const Frame expected = renderer().render(*scene.resident, from(-500));
  EXPECT_EQ(renderer_->render(*volume_, from(-500)).pixels, expected.pixels);
}

TEST_F(AheadTest, ItIsGivenUpBetweenPieces) {
  Scene scene = makeScene(*ball(200), kSmallBlocks);
  start(scene.path, 2560 * kKib);
  renderer_->render(*volume_, from(500));  // what it needs beside voxels is there
  const auto cancel = std::make_shared<std::atomic<bool>>(false);
  FrameOrder order = orderOf(from(-500));
  order.ahead = true;
  order.cancel = cancel;
  const auto frame = renderer_->begin(*volume_, std::move(order));
  ASSERT_TRUE(frame->advance());
  cancel->store(true);
  EXPECT_FALSE(frame->advance());
  EXPECT_TRUE(frame->finish().cancelled);
}

// Neither does it make what is not there, nor does it hold anything where there is no paging.
TEST_F(AheadTest, ItNeedsNothingButVoxels) {
  Scene scene = makeScene(*ball(200), kSmallBlocks);
  start(scene.path, 2560 * kKib);
  const std::uint64_t before = bytesOf("voxels");
  EXPECT_EQ(bringAhead(from(500)).stats.pages_read, 0u);
  EXPECT_EQ(bytesOf("voxels"), before);
  start(scene.path, 0);
  renderer_->render(*volume_, from(500));
  EXPECT_EQ(bringAhead(from(-500)).stats.pages_read, 0u);
}

// Where there is no room for all that a view lacks, what is nearest comes, or what comes first in the file, which here
// is farthest away.
TEST_F(AheadTest, WhatIsAskedForFirstIsTheViewsToSay) {
  Scene scene = makeScene(*ball(200), kSmallBlocks);
  View view = finest(64);
  view.eye = glm::dvec3(100, 100, 700);
  view.target = glm::dvec3(100);
  view.channels[0].transfer = {{.value = 0, .color = {0, 0, 0}, .opacity = 0},
                               {.value = 255, .color = {1, 1, 1}, .opacity = 0.1}};
  View near = view;
  near.clip = ClipBox{{0, 0, 184}, {200, 200, 200}};
  for (const Filter filter : {Filter::nearest, Filter::linear}) {
    view.filter = near.filter = filter;
    view.requests = Requests::file;
    std::uint64_t room = 8192 * kKib;
    for (Frame frame; frame.stats.absent_blocks < 80 && room > 1024 * kKib;) {
      room -= 256 * kKib;
      start(scene.path, room);
      for (int i = 0; i < 40; ++i) frame = drawAsItIs(view);
    }
    for (const Requests requests : {Requests::file, Requests::shells, Requests::transmittance}) {
      SCOPED_TRACE(static_cast<int>(requests));
      start(scene.path, room);
      view.requests = near.requests = requests;
      Frame frame;
      for (int i = 0; i < 40; ++i) frame = drawAsItIs(view);
      EXPECT_GT(frame.stats.absent_blocks, 0u) << "there is too little room for all";
      const Frame front = drawAsItIs(near);
      EXPECT_GT(front.stats.wanted_blocks, 10u);
      if (requests == Requests::file) {
        EXPECT_GT(front.stats.absent_blocks, 0u);
      } else {
        EXPECT_EQ(front.stats.absent_blocks, 0u);
      }
      // The picture is the same in the end.
      EXPECT_EQ(renderer_->render(*volume_, near).pixels, renderer().render(*scene.resident, near).pixels);
    }
  }
}

}  // namespace
}  // namespace blockwalk::test
