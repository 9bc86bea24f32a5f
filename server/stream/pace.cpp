// SPDX-License-Identifier: Apache-2.0
#include "server/stream/pace.h"

#include <algorithm>
#include <utility>

namespace blockwalk {
namespace {

constexpr double kRaiseMargin = 0.7;  // a larger scale must fit this share of the time, so that scales do not alternate
constexpr double kTrialGrowth = 1.5;  // of the cost, at twice the scale: more is not worth a trial
constexpr double kForetoldSlow = 4;   // times the budget: a still picture may have loaded something, so it must be sure
constexpr int kFreeFrames = 60;       // in a row: the link is well
constexpr int kQualityDown = 10;
constexpr int kQualityUp = 5;
constexpr std::chrono::milliseconds kLongFrame{250};

Clock::duration seconds(double value) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(value));
}

}  // namespace

bool StreamPace::setView(std::uint64_t id, const StillPicture& still, Clock::time_point now) {
  if (has_view_ && id <= newest_id_) return false;
  newest_id_ = id;
  has_view_ = true;
  ++views_waiting_;
  view_time_ = now;
  if (still.quality != still_.quality) quality_ = still.quality;
  still_ = still;
  still_samples_ = 0;
  return true;
}

void StreamPace::setLimits(std::optional<double> fps, std::optional<std::uint64_t> max_bytes_per_second) {
  if (fps) limits_.fps = *fps;
  if (max_bytes_per_second) {
    limits_.max_bytes_per_second = max_bytes_per_second;
    link_free_ = {};  // reckoned at the old rate
  }
}

bool StreamPace::acknowledge(std::uint64_t id) {
  if (!sent_id_ || id > *sent_id_) return false;
  if (!in_flight_.empty() && in_flight_.front() <= id) blocked_since_.reset();
  while (!in_flight_.empty() && in_flight_.front() < id) in_flight_.pop_front();
  if (!in_flight_.empty() && in_flight_.front() == id) in_flight_.pop_front();
  return true;
}

PaceStep StreamPace::next(Clock::time_point now) {
  const bool is_shown = has_shown_ && shown_id_ == newest_id_;
  if (!has_view_ || failed_id_ == newest_id_ || (is_shown && shown_final_)) return {};
  const auto due = is_shown ? view_time_ + kStillTime : last_start_ + seconds(1 / limits_.fps);
  if (static_cast<int>(in_flight_.size()) >= limits_.frames_in_flight) {
    if (due > now) return {.kind = PaceStep::Kind::wait, .when = due};
    if (unsent_ > 0) return {};  // it is not the client that is waited for
    was_blocked_ = was_blocked_ || !is_shown;
    if (!blocked_since_) blocked_since_ = now;
    return {};
  }
  if (unsent_ > 0 && !overlaps()) return {};
  PaceStep step{.kind = is_shown ? PaceStep::Kind::still : PaceStep::Kind::moving, .when = now, .id = newest_id_};
  if (step.kind == PaceStep::Kind::moving) {
    foresee();
    step.scale = scale_;
    step.quality = std::min(quality_, still_.quality);
  } else {
    step.quality = still_.quality;
    step.samples_begin = still_samples_;
    step.samples_end = still_.in_steps ? std::min(std::max(1, 2 * still_samples_), still_.samples) : still_.samples;
    step.is_last = step.samples_end == still_.samples;
  }
  const auto when = std::max(due, link_free_);
  if (when > now) return {.kind = PaceStep::Kind::wait, .when = when};
  return step;
}

// A frame that refines is given up at once. One of a moving view goes on, else a steady stream of views would never
// show anything; unless it takes so long that a coarser one is the better answer.
bool StreamPace::shouldCancel(const PaceStep& step, Clock::time_point begin, Clock::time_point now) const {
  if (step.kind == PaceStep::Kind::still) return true;
  return step.scale > kSmallestScale && now - begin > std::max<Clock::duration>(kLongFrame, seconds(4 / limits_.fps));
}

void StreamPace::frameDrawn(const PaceStep& step) {
  if (!has_shown_ || step.id > shown_id_) {
    // Views that came after this one's still wait; those before it were never shown.
    const std::uint64_t newer = step.id == newest_id_ ? 0 : 1;
    dropped_views_ += views_waiting_ > newer + 1 ? views_waiting_ - newer - 1 : 0;
    views_waiting_ = newer;
  }
  has_shown_ = true;
  shown_id_ = step.id;
  shown_final_ = step.is_last;
  if (step.kind == PaceStep::Kind::still && step.id == newest_id_) still_samples_ = step.samples_end;
  in_flight_.push_back(step.id);
  ++unsent_;
}

void StreamPace::frameSent(const PaceStep& step, const FrameCost& took, std::size_t bytes, Clock::time_point now) {
  const double cost_ms = overlaps() ? std::max(took.draw_ms, took.encode_ms) : took.draw_ms + took.encode_ms;
  --unsent_;
  sent_id_ = step.id;
  if (limits_.max_bytes_per_second) {
    const double share = static_cast<double>(bytes) / static_cast<double>(*limits_.max_bytes_per_second);
    link_free_ = std::max(link_free_, now) + seconds(share);
  }
  if (step.kind == PaceStep::Kind::still) {
    still_ms_ = took.draw_ms / std::max(1, step.samples_end - step.samples_begin);
    return;
  }
  // One that was under way when the scale changed says nothing about the new one.
  if (step.scale == scale_) judgeCost(cost_ms, now);
  judgeLink(bytes, now);
}

// It was too slow, nobody knows by how much or why. If it loaded something the larger scale may be right, so that a
// trial need not wait; if it did not, the smaller one is too slow for a trial.
void StreamPace::frameCancelled(const PaceStep& step) {
  // It may have gone down further while this was drawn.
  if (step.kind == PaceStep::Kind::moving) lowerScale(std::min(scale_, step.scale / 2));
}

void StreamPace::sendingFailed(const PaceStep& step) {
  // Less is in flight only where a client acknowledges what it has not yet had.
  const auto unsent = static_cast<std::size_t>(unsent_--);
  if (in_flight_.size() >= unsent) in_flight_.erase(in_flight_.end() - static_cast<std::ptrdiff_t>(unsent));
  frameFailed(step);
}

// The first frame of a move would else be the one to tell that the scale is far too large, and take that long.
void StreamPace::foresee() {
  const double still_ms = std::exchange(still_ms_, std::nullopt).value_or(0);
  if (still_ms * scale_ * scale_ <= kForetoldSlow * budgetMs()) return;
  double fitting = scale_ / 2;
  while (fitting > kSmallestScale && still_ms * fitting * fitting > budgetMs()) fitting /= 2;
  lowerScale(fitting);
}

void StreamPace::judgeCost(double cost_ms, Clock::time_point now) {
  const bool was_slow = on_trial_ || (last_cost_ms_ && *last_cost_ms_ > budgetMs());
  if (cost_ms > budgetMs() && was_slow) {
    const double cost = last_cost_ms_ ? std::min(cost_ms, *last_cost_ms_) : cost_ms;
    double fitting = scale_ / 2;
    while (fitting > kSmallestScale && cost * fitting * fitting > budgetMs() * scale_ * scale_) fitting /= 2;
    if (scale_ > kSmallestScale) cost_pause_.fail(now);
    return lowerScale(fitting);
  }
  if (on_trial_) cost_pause_.length = cost_pause_.first;
  on_trial_ = false;
  last_cost_ms_ = cost_ms;
}

void StreamPace::judgeLink(std::size_t bytes, Clock::time_point now) {
  const double frame_bytes = static_cast<double>(bytes);
  const double allowed =
      limits_.max_bytes_per_second ? static_cast<double>(*limits_.max_bytes_per_second) / limits_.fps : 2 * frame_bytes;
  const int lowest = std::min(kLowestQuality, still_.quality);
  if (was_blocked_ || frame_bytes > allowed) {
    free_frames_ = 0;
    held_up_frames_ = quality_ == lowest ? held_up_frames_ + 1 : 0;
    quality_ = std::max(lowest, quality_ - kQualityDown);
    // What is in flight was made before, and is still in the way.
    if (held_up_frames_ > limits_.frames_in_flight) {
      held_up_frames_ = 0;
      if (scale_ > kSmallestScale) link_pause_.fail(now);
      lowerScale(scale_ / 2);
    }
  } else {
    held_up_frames_ = 0;
    if (++free_frames_ >= kFreeFrames) link_pause_.length = link_pause_.first;
    if (frame_bytes < kRaiseMargin * allowed) quality_ = std::min(still_.quality, quality_ + kQualityUp);
    if (quality_ == still_.quality && now >= link_pause_.end) raiseScale(now);
  }
  was_blocked_ = false;
}

void StreamPace::raiseScale(Clock::time_point now) {
  if (scale_ == 1 || !last_cost_ms_) return;
  const double room_ms = kRaiseMargin * budgetMs();
  const bool is_sure = 4 * *last_cost_ms_ <= room_ms;
  const bool is_worth_a_trial = kTrialGrowth * *last_cost_ms_ <= room_ms && now >= cost_pause_.end;
  if (!is_sure && !is_worth_a_trial) return;
  on_trial_ = !is_sure;
  scale_ *= 2;
  last_cost_ms_.reset();
}

void StreamPace::lowerScale(double scale) {
  scale_ = std::max(scale, kSmallestScale);
  last_cost_ms_.reset();
  on_trial_ = false;
}

}  // namespace blockwalk
