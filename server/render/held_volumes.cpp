// SPDX-License-Identifier: Apache-2.0
// What the render thread holds of volumes, and how it lets go of them.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "server/render/render_thread.h"

namespace blockwalk {

void RenderThread::unload(VolumeId id) noexcept {
  const std::lock_guard lock(mutex_);
  const auto held = volumes_.find(id);
  if (held == volumes_.end()) return;
  held->second.unload = has_unloads_ = true;
  wake_.notify_all();
}

void RenderThread::giveUp(VolumeId id, const std::string& reason) {
  const std::lock_guard lock(mutex_);
  const auto held = volumes_.find(id);
  if (held == volumes_.end() || held->second.hold == VolumeHold::resident) return;
  held->second.reason = reason;
  held->second.hold = VolumeHold::broken;
  wake_.notify_all();
}

void RenderThread::retire(VolumeId id) noexcept {
  const std::lock_guard lock(mutex_);
  const auto held = volumes_.find(id);
  if (held != volumes_.end()) held->second.retired = true;
}

std::pair<VolumeHold, std::string> RenderThread::hold(VolumeId id) const {
  const std::lock_guard lock(mutex_);
  const auto held = volumes_.find(id);
  if (held == volumes_.end()) return {VolumeHold::unknown, {}};
  return {held->second.hold, held->second.reason};
}

// As endAll().
template <typename Which>
void RenderThread::dropFrames(Which which) noexcept {
  for (;;) {
    std::unique_ptr<FrameInProgress> ended;
    {
      const std::lock_guard lock(mutex_);
      queue_.forEach([&](Queue::Entry& entry) {
        if (ended == nullptr && which(std::as_const(entry))) ended = std::move(entry.job.frame);
      });
    }
    if (ended == nullptr) return;
  }
}

// Without the lock, one after the other: a frame, a volume or a device may take long to end.
void RenderThread::endAll() noexcept {
  endFrames();
  for (;;) {
    std::unique_ptr<ResidentVolume> ended;
    {
      const std::lock_guard lock(mutex_);
      const auto held = std::ranges::find_if(volumes_, [](const auto& of) { return of.second.resident != nullptr; });
      if (held == volumes_.end()) break;
      ended = std::move(held->second.resident);
    }
  }
  renderer_.reset();
}

void RenderThread::endFrames() noexcept {
  dropFrames([](const Queue::Entry&) { return true; });
}

// A load that failed broke the volume, unless the device was lost.
void RenderThread::finishLoad(VolumeId id, bool failed) noexcept {
  {
    const std::lock_guard lock(mutex_);
    const auto held = volumes_.find(id);
    if (held == volumes_.end()) return;
    if (held->second.hold == VolumeHold::loading) held->second.hold = failed ? VolumeHold::lost : VolumeHold::resident;
  }
  mailbox_.nudge();
}

// What the device holds of the volume is let go: some of it may not be what the file said. Returns the error for
// whoever asked.
std::exception_ptr RenderThread::breakVolume(VolumeId id, const char* reason) noexcept {
  dropFrames([&](const Queue::Entry& entry) { return entry.job.order.volume == id && &entry != running_; });
  std::unique_ptr<ResidentVolume> dropped;
  std::exception_ptr error;
  bool retired = false;
  {
    const std::lock_guard lock(mutex_);
    const auto held = volumes_.find(id);
    if (held == volumes_.end()) {  // it was let go meanwhile
      try {
        return std::make_exception_ptr(VolumeError(reason));
      } catch (...) {
        return std::current_exception();
      }
    }
    dropped = std::move(held->second.resident);
    held->second.hold = VolumeHold::broken;
    retired = held->second.retired;
    try {
      held->second.reason = withoutFolder(reason, held->second.file);
      error = std::make_exception_ptr(VolumeError(held->second.reason));
    } catch (...) {
      held->second.reason.clear();  // out of memory for the text: broken all the same
      error = std::current_exception();
    }
  }
  // What is served, or was about to be, its keeper tells of.
  if (retired) spdlog::error("a content that was replaced cannot be read any more: {}", reason);
  mailbox_.nudge();
  return error;
}

// What was unloaded or forgotten since.
void RenderThread::letGo() noexcept {
  std::vector<std::uint64_t> forgotten;
  std::map<VolumeId, Held> unloaded;
  {
    const std::lock_guard lock(mutex_);
    forgotten.swap(forgotten_);
    has_unloads_ = false;
    for (auto held = volumes_.begin(); held != volumes_.end();) {
      const auto current = held++;
      if (current->second.unload) unloaded.insert(volumes_.extract(current));
    }
  }
  dropFrames([&](const Queue::Entry& entry) { return unloaded.contains(entry.job.order.volume); });
  for (const std::uint64_t owner : forgotten) {
    try {
      renderer_->forget(owner);
    } catch (const std::exception& error) {
      spdlog::warn("sums are kept until their memory is needed: {}", error.what());
    }
  }
  unloaded.clear();
  noteMemory();
}

}  // namespace blockwalk
