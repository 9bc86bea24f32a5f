// SPDX-License-Identifier: Apache-2.0
// When a stream draws its next frame, and how: the rules of latest-wins, frames in flight, target rate and refinement,
// without sockets and without a clock of its own.
//
// While views keep coming, frames are drawn at a scale (1, 1/2, 1/4, 1/8) and a quality that hold the target rate. Once
// the view has stood still, it is refined at full resolution in steps: of 1, 2, 4, 8 ... samples a pixel and at last of
// all that it asks for. Steps follow each other as fast as the client acknowledges them.
//
// The scale goes down when two frames in a row are too slow (one may be: it loaded something), or when the client does
// not keep up at the lowest quality; and at once when the still picture before a move foretells a frame far too slow.
// It goes up when even a cost that grows with the pixels would fit. A part of the cost does not grow, so that otherwise
// a larger scale is tried out: should it be too slow, one frame tells, and the next trial waits twice as long.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>

namespace blockwalk {

using Clock = std::chrono::steady_clock;

struct PaceLimits {
  int frames_in_flight = 3;
  double fps = 30;
  std::optional<std::uint64_t> max_bytes_per_second;
};

struct PaceStep {
  enum class Kind { wait, moving, still };
  Kind kind = Kind::wait;
  Clock::time_point when = Clock::time_point::max();  // wait: look again then, or when something changes
  std::uint64_t id = 0;                               // the view to draw
  double scale = 1;
  int quality = 85;
  int samples_begin = 0;  // still: of the view's, that the step before ended with; 0: it is the first
  int samples_end = 1;    // that the frame shows
  bool is_last = false;   // still: the view's own picture
};

// What the still picture of a view takes.
struct StillPicture {
  int quality = 85;
  int samples = 1;
  bool in_steps = true;  // false: all samples in one
};

// Of one frame. Whichever takes longer is what the frames after it wait for, where they overlap.
struct FrameCost {
  double draw_ms = 0;
  double encode_ms = 0;
};

class StreamPace {
 public:
  static constexpr std::chrono::milliseconds kStillTime{150};
  static constexpr double kSmallestScale = 0.125;
  static constexpr int kLowestQuality = 35;

  explicit StreamPace(const PaceLimits& limits) : limits_(limits) {}

  // False, and nothing changes, unless `id` is greater than every id before.
  bool setView(std::uint64_t id, const StillPicture& still, Clock::time_point now);
  void setLimits(std::optional<double> fps, std::optional<std::uint64_t> max_bytes_per_second);
  // False when no frame of this id, or a newer one, was sent.
  bool acknowledge(std::uint64_t id);

  PaceStep next(Clock::time_point now);
  // Since when a frame is due but as many as may be are unacknowledged; as next() found it.
  std::optional<Clock::time_point> blockedSince() const { return blocked_since_; }
  // A new view came while `step` is being drawn since `begin`: should it be given up?
  bool shouldCancel(const PaceStep& step, Clock::time_point begin, Clock::time_point now) const;

  void frameStarted(Clock::time_point now) { last_start_ = now; }
  // It is in flight from now on, and the next one may be drawn while this one is encoded.
  void frameDrawn(const PaceStep& step);
  // Frames are sent in the order in which they were drawn.
  void frameSent(const PaceStep& step, const FrameCost& took, std::size_t bytes, Clock::time_point now);
  void frameCancelled(const PaceStep& step);
  // The view cannot be drawn or, drawn, not be sent; nothing more is tried until another comes.
  void frameFailed(const PaceStep& step) { failed_id_ = step.id; }
  void sendingFailed(const PaceStep& step);

  std::uint64_t newestId() const { return newest_id_; }
  std::uint64_t droppedViews() const { return dropped_views_; }
  const PaceLimits& limits() const { return limits_; }

 private:
  double budgetMs() const { return 1000 / limits_.fps; }
  // Whether one frame is drawn while another is encoded: where the link is bound the bytes of one must be known before.
  bool overlaps() const { return !limits_.max_bytes_per_second && limits_.frames_in_flight > 1; }
  void foresee();
  void judgeCost(double cost_ms, Clock::time_point now);
  void judgeLink(std::size_t bytes, Clock::time_point now);
  void raiseScale(Clock::time_point now);
  void lowerScale(double scale);

  // Before a larger scale is tried again: twice as long after each failure, as at first after a success.
  struct Pause {
    Clock::duration first;
    Clock::duration longest;
    Clock::duration length = first;
    Clock::time_point end{};
    void fail(Clock::time_point now) {
      end = now + length;
      length = std::min(2 * length, longest);
    }
  };

  PaceLimits limits_;
  std::uint64_t newest_id_ = 0;
  std::optional<std::uint64_t> failed_id_;
  std::optional<std::uint64_t> sent_id_;
  std::uint64_t shown_id_ = 0;  // drawn, at least
  bool has_view_ = false;
  bool has_shown_ = false;
  bool shown_final_ = false;
  bool was_blocked_ = false;         // a frame was due while as many as may be were in flight
  bool on_trial_ = false;            // the scale is tried out
  std::uint64_t views_waiting_ = 0;  // came since the view that was shown last
  std::uint64_t dropped_views_ = 0;
  StillPicture still_;     // of the newest view
  int still_samples_ = 0;  // that its steps have shown
  int quality_ = 85;
  double scale_ = 0.5;                       // the first frame's cost is unknown
  std::optional<double> last_cost_ms_ = {};  // of the newest frame at this scale
  std::optional<double> still_ms_ = {};  // of one sample of the newest still picture; none once a frame was foretold
  Pause cost_pause_{std::chrono::seconds(10), std::chrono::seconds(80)};
  Pause link_pause_{std::chrono::seconds(2), std::chrono::seconds(16)};
  int held_up_frames_ = 0;  // in a row, at the lowest quality
  int free_frames_ = 0;     // in a row that the client kept up with
  int unsent_ = 0;          // of those in flight, the last
  std::optional<Clock::time_point> blocked_since_ = {};
  Clock::time_point view_time_{};
  Clock::time_point last_start_{};
  Clock::time_point link_free_{};  // when the bytes sent so far fit max_bytes_per_second
  std::deque<std::uint64_t> in_flight_;
};

}  // namespace blockwalk
