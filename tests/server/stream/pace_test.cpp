// SPDX-License-Identifier: Apache-2.0
#include "server/stream/pace.h"

#include <gtest/gtest.h>

#include <deque>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/server/stream/pace_steps.h"

namespace blockwalk {
namespace {

using std::chrono::milliseconds;
using Kind = PaceStep::Kind;

TEST(StreamPace, WaitsForAView) {
  StreamPace pace({});
  EXPECT_EQ(pace.next(kStart).kind, Kind::wait);
  EXPECT_EQ(pace.next(kStart).when, Clock::time_point::max());
}

TEST(StreamPace, DrawsTheMovingViewThenTheStillOneThenNothing) {
  StreamPace pace({});
  pace.setView(4, {}, kStart);
  const PaceStep moving = pace.next(kStart);
  EXPECT_EQ(moving.kind, Kind::moving);
  EXPECT_EQ(moving.id, 4u);
  pace.frameStarted(kStart);
  sendDrawn(pace, moving, 10, 1000, kStart);
  EXPECT_EQ(pace.next(kStart).when, kStart + StreamPace::kStillTime);
  const PaceStep still = pace.next(kStart + StreamPace::kStillTime);
  EXPECT_EQ(still.kind, Kind::still);
  EXPECT_EQ(still.scale, 1);
  sendDrawn(pace, still, 10, 1000, kStart);
  EXPECT_EQ(pace.next(kStart + milliseconds(1000)).when, Clock::time_point::max());
}

// (begin, end, is_last) of the steps of a still view.
std::vector<std::tuple<int, int, bool>> stepsOf(const StillPicture& still) {
  StreamPace pace({});
  pace.setView(1, still, kStart);
  sendDrawn(pace, pace.next(kStart), 10, 1000, kStart);
  pace.acknowledge(1);
  std::vector<std::tuple<int, int, bool>> steps;
  const auto later = kStart + StreamPace::kStillTime;
  for (PaceStep step = pace.next(later); step.kind == Kind::still; step = pace.next(later)) {
    EXPECT_EQ(step.scale, 1);
    steps.emplace_back(step.samples_begin, step.samples_end, step.is_last);
    sendDrawn(pace, step, 10, 1000, later);
    pace.acknowledge(1);
  }
  EXPECT_EQ(pace.next(later).when, Clock::time_point::max());
  return steps;
}

TEST(StreamPace, RefinesInStepsThatDouble) {
  using Steps = std::vector<std::tuple<int, int, bool>>;
  EXPECT_EQ(stepsOf({}), (Steps{{0, 1, true}}));
  EXPECT_EQ(stepsOf({.samples = 2}), (Steps{{0, 1, false}, {1, 2, true}}));
  EXPECT_EQ(stepsOf({.samples = 9}), (Steps{{0, 1, false}, {1, 2, false}, {2, 4, false}, {4, 8, false}, {8, 9, true}}));
  EXPECT_EQ(stepsOf({.samples = 9, .in_steps = false}), (Steps{{0, 9, true}}));
  EXPECT_EQ(stepsOf({.samples = 256}).size(), 9u);
}

TEST(StreamPace, StepsWaitForTheirPlaceInFlightAndForTheLink) {
  StreamPace pace({.frames_in_flight = 3, .fps = 120, .max_bytes_per_second = 10000});
  pace.setView(1, {.samples = 16}, kStart);
  sendDrawn(pace, pace.next(kStart), 1, 10, kStart);
  auto now = kStart + milliseconds(1000);
  sendDrawn(pace, pace.next(now), 1, 1000, now);
  EXPECT_EQ(pace.next(now).when, now + milliseconds(100)) << "a tenth of a second's bytes";
  now += milliseconds(100);
  sendDrawn(pace, pace.next(now), 1, 10, now);
  now += milliseconds(1000);
  EXPECT_EQ(pace.next(now).kind, Kind::wait) << "three are in flight";
  pace.acknowledge(1);
  EXPECT_EQ(pace.next(now).samples_begin, 2) << "none was left out";
}

TEST(StreamPace, ANewViewEndsTheSteps) {
  StreamPace pace({});
  pace.setView(1, {.samples = 4}, kStart);
  sendDrawn(pace, pace.next(kStart), 1, 10, kStart);
  const auto later = kStart + milliseconds(1000);
  pace.acknowledge(1);
  const PaceStep first = pace.next(later);
  EXPECT_TRUE(pace.shouldCancel(first, later, later));
  pace.setView(2, {.samples = 4}, later);
  sendDrawn(pace, first, 1, 10, later);  // too late to be cancelled
  pace.acknowledge(1);
  const PaceStep moving = pace.next(later);
  EXPECT_EQ(moving.kind, Kind::moving);
  EXPECT_EQ(moving.samples_end, 1);
  sendDrawn(pace, moving, 1, 10, later);
  pace.acknowledge(2);
  const PaceStep still = pace.next(later + milliseconds(1000));
  EXPECT_EQ(still.samples_begin, 0) << "what was drawn of another view does not count";
  EXPECT_EQ(still.samples_end, 1);
}

TEST(StreamPace, IdsOnlyGrow) {
  StreamPace pace({});
  EXPECT_TRUE(pace.setView(0, {}, kStart));
  EXPECT_FALSE(pace.setView(0, {}, kStart));
  EXPECT_TRUE(pace.setView(7, {}, kStart));
  EXPECT_FALSE(pace.setView(6, {}, kStart));
  EXPECT_EQ(pace.newestId(), 7u);
}

TEST(StreamPace, StopsAtTheFramesInFlightAndGoesOnWithAnAck) {
  StreamPace pace({.frames_in_flight = 3, .fps = 120, .max_bytes_per_second = {}});
  auto now = kStart;
  for (std::uint64_t id = 1; id <= 3; ++id) {
    pace.setView(id, {}, now);
    const PaceStep step = pace.next(now);
    ASSERT_EQ(step.kind, Kind::moving) << id;
    sendDrawn(pace, step, 1, 1000, now);
    now += milliseconds(100);
  }
  pace.setView(4, {}, now);
  EXPECT_EQ(pace.next(now).kind, Kind::wait);
  EXPECT_FALSE(pace.acknowledge(9));  // never sent
  EXPECT_TRUE(pace.acknowledge(2));   // and with it the first
  EXPECT_EQ(pace.next(now).kind, Kind::moving);
}

// Draws for `seconds` with a new view every 5 ms; a frame costs `full_ms` times the square of its scale.
struct Drive {
  int frames = 0;
  double last_scale = 0;
  int last_quality = 0;
  int changes = 0;  // of scale, in the second half
  double bytes = 0;
};
Drive drive(StreamPace& pace, double full_ms, double full_bytes, int total_ms) {
  Drive run;
  std::uint64_t id = 0;
  auto now = kStart;
  const auto end = kStart + milliseconds(total_ms);
  while (now < end) {
    pace.setView(++id, {}, now);
    const PaceStep step = pace.next(now);
    if (step.kind != Kind::moving) {
      now += milliseconds(5);
      continue;
    }
    pace.frameStarted(now);
    const double cost = full_ms * step.scale * step.scale;
    now += std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double, std::milli>(cost + 0.1));
    const double bytes = full_bytes * step.scale * step.scale * step.quality / 85;
    sendDrawn(pace, step, cost, static_cast<std::size_t>(bytes), now);
    pace.acknowledge(step.id);
    if (now > kStart + milliseconds(total_ms / 2) && run.last_scale != step.scale) ++run.changes;
    run.last_scale = step.scale;
    run.last_quality = step.quality;
    run.bytes += bytes;
    ++run.frames;
  }
  return run;
}

TEST(StreamPace, TakesTheScaleThatHoldsTheRate) {
  for (const auto& [full_ms, scale] :
       {std::pair{5.0, 1.0}, {20.0, 1.0}, {100.0, 0.5}, {400.0, 0.25}, {5000.0, 0.125}}) {
    StreamPace pace({});
    const Drive run = drive(pace, full_ms, 1e5, 10000);
    EXPECT_EQ(run.last_scale, scale) << full_ms;
    EXPECT_LE(run.changes, 1) << full_ms;
    EXPECT_GE(run.frames, scale > 0.125 ? 200 : 90) << full_ms;  // of at most 300
    EXPECT_LE(run.frames, 301) << full_ms;
  }
}

// A client behind a link: frames cost `fixed_ms` and `full_ms` times the square of the scale; each is acknowledged when
// the link has carried it, one after the other.
struct Rig {
  StreamPace pace{PaceLimits{}};
  Clock::time_point now = kStart;
  double fixed_ms = 0;
  double full_ms = 0;
  double full_bytes = 1e5;
  double bytes_per_ms = 1e9;
  double extra_ms = 0;  // of the next frame alone: it loads something
  std::uint64_t id = 0;
  Clock::time_point link_free = kStart;
  std::deque<std::pair<Clock::time_point, std::uint64_t>> acks = {};
  PaceStep last = {};

  struct Run {
    int frames = 0;
    int changes = 0;  // of scale
    double smallest = 1;
  };
  Run drag(int total_ms) {
    Run run;
    const auto end = now + milliseconds(total_ms);
    for (; now < end; now += milliseconds(1)) {
      while (!acks.empty() && acks.front().first <= now) {
        EXPECT_TRUE(pace.acknowledge(acks.front().second));
        acks.pop_front();
      }
      pace.setView(++id, {}, now);
      const PaceStep step = pace.next(now);
      if (step.kind != Kind::moving) continue;
      draw(step, run);
    }
    return run;
  }
  void draw(const PaceStep& step, Run& run) {
    const auto ms = [](double value) {
      return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double, std::milli>(value));
    };
    const double area = step.scale * step.scale;
    const double cost = fixed_ms + full_ms * area + std::exchange(extra_ms, 0);
    const double bytes = full_bytes * area * step.quality / 85;
    pace.frameStarted(now);
    now += ms(cost);
    sendDrawn(pace, step, cost, static_cast<std::size_t>(bytes), now);
    link_free = std::max(link_free, now) + ms(bytes / bytes_per_ms);
    acks.emplace_back(link_free, step.id);
    if (step.scale != last.scale) ++run.changes;
    run.smallest = std::min(run.smallest, step.scale);
    last = step;
    ++run.frames;
  }
};

TEST(StreamPace, AStillPictureForetellsTheFirstFrameOfAMove) {
  for (const auto& [still_ms, samples, scale] :
       {std::tuple{30.0, 1, 0.5}, {500.0, 1, 0.5}, {1500.0, 1, 0.125}, {600.0, 1, 0.125}, {1500.0, 16, 0.5}}) {
    StreamPace pace({});
    auto now = kStart;
    pace.setView(1, {.quality = 85, .samples = samples, .in_steps = false}, now);
    sendDrawn(pace, pace.next(now), 20, 1000, now);
    pace.acknowledge(1);
    now += StreamPace::kStillTime;
    const PaceStep still = pace.next(now);
    ASSERT_EQ(still.kind, Kind::still);
    now += milliseconds(1000);
    sendDrawn(pace, still, still_ms, 1000, now);
    pace.acknowledge(1);
    now += milliseconds(1000);
    pace.setView(2, {}, now);
    EXPECT_EQ(pace.next(now).scale, scale) << still_ms << ", " << samples;
    EXPECT_EQ(pace.next(now).scale, scale) << "once";
  }
}

TEST(StreamPace, QuickFramesAreDrawnAtFullScale) {
  for (const double fixed_ms : {0.0, 6.0, 8.5}) {  // a frame at full scale costs 9 ms each time
    Rig rig{.fixed_ms = fixed_ms, .full_ms = 9 - fixed_ms};
    rig.drag(500);
    const Rig::Run run = rig.drag(10000);
    EXPECT_EQ(run.smallest, 1) << fixed_ms;
    EXPECT_GE(run.frames, 280) << fixed_ms;
  }
}

TEST(StreamPace, OneSlowFrameDoesNotTakeTheScaleAway) {
  Rig rig{.fixed_ms = 6, .full_ms = 3};
  rig.extra_ms = 600;  // the first one
  rig.drag(1500);
  EXPECT_EQ(rig.last.scale, 1);
  rig.extra_ms = 600;
  EXPECT_EQ(rig.drag(2000).smallest, 1);
}

TEST(StreamPace, TheScaleComesBackAfterASlowSpell) {
  Rig rig{.fixed_ms = 6, .full_ms = 400};
  rig.drag(2000);
  EXPECT_LT(rig.last.scale, 0.5);
  rig.full_ms = 3;
  rig.drag(12000);
  EXPECT_EQ(rig.last.scale, 1);
}

TEST(StreamPace, SlowFramesSettleAtAScaleThatHoldsTheRate) {
  Rig rig{.full_ms = 200};
  rig.drag(1000);
  const Rig::Run run = rig.drag(10000);
  EXPECT_GE(run.frames, 240) << "30 a second within 20 %";
  EXPECT_LE(run.changes, 2) << "no oscillation: one trial of a larger scale at most";
}

TEST(StreamPace, ASlowLinkLowersQualityThenScaleAndBothRecover) {
  Rig rig{.full_ms = 5};
  rig.drag(1000);
  ASSERT_EQ(rig.last.scale, 1);
  rig.bytes_per_ms = 2000;  // 20 frames a second at full scale and quality
  rig.drag(3000);
  EXPECT_EQ(rig.last.scale, 1) << "quality is enough";
  EXPECT_LT(rig.last.quality, 85);
  rig.bytes_per_ms = 300;
  rig.drag(3000);
  EXPECT_LT(rig.last.scale, 1);
  const Rig::Run slow = rig.drag(10000);
  EXPECT_GE(slow.frames, 200);
  rig.bytes_per_ms = 1e9;
  rig.drag(20000);
  EXPECT_EQ(rig.last.scale, 1);
  EXPECT_EQ(rig.last.quality, 85);
}

TEST(StreamPace, HoldsTheBytesASecond) {
  StreamPace pace({.frames_in_flight = 3, .fps = 30, .max_bytes_per_second = 500000});
  const Drive run = drive(pace, 5, 40000, 10000);
  EXPECT_LE(run.bytes, 1.05 * 500000 * 10);
  EXPECT_LT(run.last_quality, 60);
}

TEST(StreamPace, GivesUpRefinementAtOnceAndMovingFramesOnlyWhenTheyAreLong) {
  const StreamPace pace({});
  const PaceStep still{.kind = Kind::still, .scale = 1};
  EXPECT_TRUE(pace.shouldCancel(still, kStart, kStart));
  const PaceStep moving{.kind = Kind::moving, .scale = 0.5};
  EXPECT_FALSE(pace.shouldCancel(moving, kStart, kStart + milliseconds(100)));
  EXPECT_TRUE(pace.shouldCancel(moving, kStart, kStart + milliseconds(300)));
  const PaceStep smallest{.kind = Kind::moving, .scale = StreamPace::kSmallestScale};
  EXPECT_FALSE(pace.shouldCancel(smallest, kStart, kStart + milliseconds(3000)));
}

TEST(StreamPace, ACancelledFrameMakesTheNextOneCoarser) {
  StreamPace pace({});
  pace.setView(1, {}, kStart);
  const PaceStep first = pace.next(kStart);
  pace.frameCancelled(first);
  EXPECT_LT(pace.next(kStart).scale, first.scale);
}

TEST(StreamPace, CountsTheViewsThatNoFrameShowed) {
  StreamPace pace({});
  for (std::uint64_t id = 1; id <= 5; ++id) pace.setView(id, {}, kStart);
  sendDrawn(pace, pace.next(kStart), 1, 1, kStart);
  EXPECT_EQ(pace.droppedViews(), 4u);
}

}  // namespace
}  // namespace blockwalk
