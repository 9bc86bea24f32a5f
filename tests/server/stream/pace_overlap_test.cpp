// SPDX-License-Identifier: Apache-2.0
// The pace of a stream that draws the next frame while one is encoded.
#include <gtest/gtest.h>

#include "tests/server/stream/pace_steps.h"

namespace blockwalk {
namespace {

using std::chrono::milliseconds;
using Kind = PaceStep::Kind;

// A view that moves ten times a second.
struct Moves {
  StreamPace& pace;
  Clock::time_point now = kStart;
  std::uint64_t id = 0;
  PaceStep next() {
    now += milliseconds(100);
    pace.setView(++id, {}, now);
    return pace.next(now);
  }
};

TEST(StreamPace, DrawsTheNextViewWhileOneIsEncoded) {
  StreamPace pace({.frames_in_flight = 2, .fps = 120, .max_bytes_per_second = {}});
  pace.setView(1, {}, kStart);
  const PaceStep first = pace.next(kStart);
  pace.frameDrawn(first);
  EXPECT_FALSE(pace.acknowledge(1)) << "it was not sent";
  EXPECT_NE(pace.next(kStart).kind, Kind::moving) << "it is the newest";
  const auto now = kStart + milliseconds(100);
  pace.setView(2, {}, now);
  const PaceStep second = pace.next(now);
  EXPECT_EQ(second.kind, Kind::moving);
  pace.frameDrawn(second);
  pace.setView(3, {}, now);
  EXPECT_EQ(pace.next(now).kind, Kind::wait) << "two are in flight";
  pace.frameSent(first, {.draw_ms = 1, .encode_ms = 0}, 1000, now);
  EXPECT_TRUE(pace.acknowledge(1));
  EXPECT_FALSE(pace.acknowledge(2));
  EXPECT_EQ(pace.next(now).id, 3u);
}

TEST(StreamPace, WhereTheLinkIsBoundTheBytesOfOneAreKnownBeforeTheNext) {
  StreamPace pace({.frames_in_flight = 3, .fps = 120, .max_bytes_per_second = 10000});
  pace.setView(1, {}, kStart);
  const PaceStep first = pace.next(kStart);
  pace.frameDrawn(first);
  pace.setView(2, {}, kStart + milliseconds(50));
  EXPECT_EQ(pace.next(kStart + milliseconds(50)).when, Clock::time_point::max());
  pace.frameSent(first, {.draw_ms = 1, .encode_ms = 0}, 1000, kStart + milliseconds(50));
  EXPECT_EQ(pace.next(kStart + milliseconds(50)).when, kStart + milliseconds(150));
}

TEST(StreamPace, AnEncoderThatIsSlowIsNotAClientThatIs) {
  StreamPace pace({.frames_in_flight = 2, .fps = 120, .max_bytes_per_second = {}});
  Moves moves{pace};
  PaceStep under_way = moves.next();
  pace.frameDrawn(under_way);
  for (int i = 0; i < 20; ++i) {
    const PaceStep step = moves.next();
    ASSERT_EQ(step.kind, Kind::moving) << i;
    EXPECT_EQ(step.quality, 85) << i;
    pace.frameDrawn(step);
    EXPECT_EQ(moves.next().kind, Kind::wait) << "two are drawn and not sent";
    EXPECT_FALSE(pace.blockedSince().has_value());
    pace.frameSent(under_way, {.draw_ms = 1, .encode_ms = 1}, 10, moves.now);
    pace.acknowledge(under_way.id);
    under_way = step;
  }
}

TEST(StreamPace, WhereNothingOverlapsAFrameCostsBoth) {
  for (const int in_flight : {1, 2}) {
    StreamPace pace({.frames_in_flight = in_flight, .fps = 30, .max_bytes_per_second = {}});
    Moves moves{pace};
    double scale = 0;
    for (int i = 0; i < 3; ++i) {
      const PaceStep step = moves.next();
      scale = i == 0 ? step.scale : scale;
      EXPECT_EQ(step.scale, i == 2 && in_flight == 1 ? scale / 2 : scale) << in_flight;
      pace.frameDrawn(step);
      pace.frameSent(step, {.draw_ms = 25, .encode_ms = 25}, 10, moves.now);
      pace.acknowledge(step.id);
    }
  }
}

TEST(StreamPace, ACancelledFrameDoesNotRaiseTheScale) {
  StreamPace pace({.frames_in_flight = 8, .fps = 30, .max_bytes_per_second = {}});
  Moves moves{pace};
  sendDrawn(pace, moves.next(), 1500, 10, moves.now);
  const PaceStep slow = moves.next();
  pace.frameDrawn(slow);
  const PaceStep under_way = moves.next();
  pace.frameSent(slow, {.draw_ms = 1500, .encode_ms = 0}, 10, moves.now);
  const double scale = moves.next().scale;
  EXPECT_EQ(scale, StreamPace::kSmallestScale);
  pace.frameCancelled(under_way);
  EXPECT_EQ(moves.next().scale, scale);
}

TEST(StreamPace, WhatCannotBeSentIsNotInFlightAndNotTriedAgain) {
  StreamPace pace({.frames_in_flight = 2, .fps = 120, .max_bytes_per_second = {}});
  pace.setView(1, {}, kStart);
  const PaceStep first = pace.next(kStart);
  pace.frameDrawn(first);
  pace.sendingFailed(first);
  pace.frameDrawn(first);  // another step of it was under way
  const auto later = kStart + milliseconds(1000);
  EXPECT_EQ(pace.next(later).when, Clock::time_point::max());
  EXPECT_FALSE(pace.acknowledge(1));
  pace.setView(2, {}, later);
  EXPECT_EQ(pace.next(later).id, 2u);
}

// A frame that was under way when the scale went down is slow, and not for the new scale.
TEST(StreamPace, AFrameOfAnotherScaleDoesNotJudgeThisOne) {
  StreamPace pace({.frames_in_flight = 8, .fps = 30, .max_bytes_per_second = {}});
  Moves moves{pace};
  const double scale = moves.next().scale;
  sendDrawn(pace, moves.next(), 40, 10, moves.now);
  const PaceStep slow = moves.next();
  pace.frameDrawn(slow);
  const PaceStep late = moves.next();
  pace.frameDrawn(late);
  pace.frameSent(slow, {.draw_ms = 40, .encode_ms = 0}, 10, moves.now);
  EXPECT_EQ(moves.next().scale, scale / 2);
  pace.frameSent(late, {.draw_ms = 40, .encode_ms = 0}, 10, moves.now);
  sendDrawn(pace, moves.next(), 34, 10, moves.now);
  EXPECT_EQ(moves.next().scale, scale / 2) << "one slow frame of the new scale is not two";
}

}  // namespace
}  // namespace blockwalk
