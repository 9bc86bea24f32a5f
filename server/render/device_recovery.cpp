// SPDX-License-Identifier: Apache-2.0
// What the render thread does when the device is lost.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <new>

#include "server/render/render_thread.h"

namespace blockwalk {
namespace {

constexpr std::chrono::seconds kShortOrder{60};
constexpr std::chrono::milliseconds kReopenPause{250};

// Calls use(text) without taking memory for it.
template <typename Use>
void withText(const std::exception_ptr& error, Use use) {
  try {
    std::rethrow_exception(error);
  } catch (const std::exception& thrown) {
    use(thrown.what());
  }
}

bool hangs(const std::exception_ptr& error) {
  try {
    std::rethrow_exception(error);
  } catch (const DeviceHangs&) {
    return true;
  } catch (...) {
    return false;
  }
}

template <typename Owned>
void leaveBehind(std::unique_ptr<Owned>& owner) noexcept {
  [[maybe_unused]] const Owned* left = owner.release();
}

}  // namespace

// All that was on the device is gone. Frames begin anew once there is another and their volume is loaded again; what
// was being loaded fails, as its file was taken.
void RenderThread::recover(std::exception_ptr why, std::unique_ptr<FrameInProgress> frame) noexcept {
  if (hangs(why)) {
    leaveBehind(frame);
    abandon();
  }
  frame.reset();
  endFrames();
  withText(why, [](const char* text) { spdlog::error("the device was lost, and is opened again: {}", text); });
  {
    const std::lock_guard lock(mutex_);
    ++status_.losses;
    queue_.forEach([&](Queue::Entry& entry) {
      if (!entry.job.is_load || entry.job.file) return;
      const auto held = volumes_.find(entry.job.order.volume);
      if (held != volumes_.end()) held->second.hold = VolumeHold::lost;
      RenderResult failed;
      failed.error = why;
      queue_.remove(entry).order.done(std::move(failed));
    });
    for (auto& [id, held] : volumes_) {
      if (held.hold != VolumeHold::resident) continue;
      held.hold = held.retired ? VolumeHold::broken : VolumeHold::lost;
      if (held.retired) held.reason = "was replaced";  // so short that it takes no memory
    }
  }
  endAll();
  std::rotate(loss_times_.begin(), loss_times_.begin() + 1, loss_times_.end());
  loss_times_.back() = Clock::now();
  const bool in_short_order =
      loss_times_.front() != Clock::time_point() && loss_times_.back() - loss_times_.front() < kShortOrder;
  if (in_short_order || status_.abandoned >= kMaxLosses || !openAgain()) giveUp(why);
}

void RenderThread::abandon() noexcept {
  const std::lock_guard lock(mutex_);
  queue_.forEach([](Queue::Entry& entry) { leaveBehind(entry.job.frame); });
  for (auto& [id, held] : volumes_) leaveBehind(held.resident);
  leaveBehind(renderer_);
  ++status_.abandoned;
  spdlog::error("the device hangs: it is left behind with {} bytes on it, as device {} of at most {}",
                status_.memory_used_bytes, status_.abandoned, kMaxLosses);
}

bool RenderThread::openAgain() noexcept {
  auto pause = kReopenPause;
  for (std::size_t attempt = 0; attempt < kMaxLosses; ++attempt, pause *= 2) {
    try {
      openDevice();
      return true;
    } catch (const std::exception& error) {
      spdlog::error("the device does not open again: {}", error.what());
    }
    std::unique_lock lock(mutex_);
    if (wake_.wait_for(lock, pause, [this] { return stopping_; })) return false;
  }
  return false;
}

void RenderThread::giveUp(std::exception_ptr why) noexcept {
  renderer_.reset();
  {
    const std::lock_guard lock(mutex_);
    try {
      withText(why, [this](const char* text) { status_.error = text; });
    } catch (const std::bad_alloc&) {
      status_.error.clear();  // it ends all the same
    }
  }
  tell(DeviceState::gone);
}

}  // namespace blockwalk
