// SPDX-License-Identifier: Apache-2.0
#include "server/stream_pace.h"

#include <algorithm>

namespace blockwalk {
namespace {

constexpr double kRaiseMargin = 0.7;  // a larger scale must fit this share of the time, so that scales do not alternate
constexpr double kCostWeight = 0.3;   // of the newest frame in the estimate
constexpr int kQualityDown = 10;
constexpr int kQualityUp = 5;
constexpr std::chrono::milliseconds kLongFrame{250};

Clock::duration seconds(double value) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(value));
}

}  // namespace

bool StreamPace::setView(std::uint64_t id, int quality, Clock::time_point now) {
  if (has_view_ && id <= newest_id_) return false;
  newest_id_ = id;
  has_view_ = true;
  ++views_waiting_;
  view_time_ = now;
  if (quality != full_quality_) quality_ = quality;
  full_quality_ = quality;
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
  if (!has_shown_ || id > shown_id_) return false;
  while (!in_flight_.empty() && in_flight_.front() < id) in_flight_.pop_front();
  if (!in_flight_.empty() && in_flight_.front() == id) in_flight_.pop_front();
  return true;
}

PaceStep StreamPace::next(Clock::time_point now) {
  const bool is_shown = has_shown_ && shown_id_ == newest_id_;
  if (!has_view_ || (is_shown && shown_final_)) return {};
  if (static_cast<int>(in_flight_.size()) >= limits_.frames_in_flight) {
    was_blocked_ = was_blocked_ || !is_shown;
    return {};
  }
  PaceStep step{.kind = is_shown ? PaceStep::Kind::still : PaceStep::Kind::moving, .when = now, .id = newest_id_};
  if (step.kind == PaceStep::Kind::moving) {
    chooseScale();
    step.scale = scale_;
    step.quality = std::min(quality_, full_quality_);
  } else {
    step.quality = full_quality_;
  }
  const auto due = is_shown ? view_time_ + kStillTime : last_start_ + seconds(1 / limits_.fps);
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

void StreamPace::frameSent(const PaceStep& step, double cost_ms, std::size_t bytes, Clock::time_point now) {
  if (!has_shown_ || step.id > shown_id_) {
    // Views that came after this one's still wait; those before it were never shown.
    const std::uint64_t newer = step.id == newest_id_ ? 0 : 1;
    dropped_views_ += views_waiting_ > newer + 1 ? views_waiting_ - newer - 1 : 0;
    views_waiting_ = newer;
  }
  has_shown_ = true;
  shown_id_ = step.id;
  shown_final_ = step.kind == PaceStep::Kind::still;
  in_flight_.push_back(step.id);
  if (limits_.max_bytes_per_second) {
    const double share = static_cast<double>(bytes) / static_cast<double>(*limits_.max_bytes_per_second);
    link_free_ = std::max(link_free_, now) + seconds(share);
  }
  if (step.kind == PaceStep::Kind::still) return;
  const double full_cost = cost_ms / (step.scale * step.scale);
  full_cost_ms_ = full_cost_ms_ == 0 ? full_cost : full_cost_ms_ + kCostWeight * (full_cost - full_cost_ms_);
  chooseQuality(bytes);
}

void StreamPace::frameCancelled(const PaceStep& step) {
  if (step.kind == PaceStep::Kind::still) return;
  // It was slower than expected, nobody knows by how much.
  const double budget_ms = 1000 / limits_.fps;
  full_cost_ms_ = std::max(2 * full_cost_ms_, 2 * budget_ms / (step.scale * step.scale));
}

void StreamPace::frameFailed(const PaceStep& step) {
  has_shown_ = true;
  shown_id_ = step.id;
  shown_final_ = true;
}

void StreamPace::chooseScale() {
  if (full_cost_ms_ == 0) return;
  const double budget_ms = 1000 / limits_.fps;
  double fitting = 1;
  while (fitting > kSmallestScale && full_cost_ms_ * fitting * fitting > budget_ms) fitting /= 2;
  if (fitting <= scale_) {
    scale_ = fitting;
  } else {
    while (scale_ < fitting && full_cost_ms_ * 4 * scale_ * scale_ <= kRaiseMargin * budget_ms) scale_ *= 2;
  }
}

void StreamPace::chooseQuality(std::size_t bytes) {
  const double frame_bytes = static_cast<double>(bytes);
  const double allowed =
      limits_.max_bytes_per_second ? static_cast<double>(*limits_.max_bytes_per_second) / limits_.fps : 2 * frame_bytes;
  if (was_blocked_ || frame_bytes > allowed) {
    quality_ = std::max(std::min(kLowestQuality, full_quality_), quality_ - kQualityDown);
  } else if (frame_bytes < kRaiseMargin * allowed) {
    quality_ = std::min(full_quality_, quality_ + kQualityUp);
  }
  was_blocked_ = false;
}

}  // namespace blockwalk
