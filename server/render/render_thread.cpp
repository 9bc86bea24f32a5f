// SPDX-License-Identifier: Apache-2.0
#include "server/render/render_thread.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "server/base/elapsed.h"

namespace blockwalk {
namespace {

bool isCancelled(const FrameOrder& order) { return order.cancel != nullptr && *order.cancel; }

}  // namespace

std::string withoutFolder(std::string text, const std::filesystem::path& file) {
  const std::string path = file.string();
  const std::string name = file.filename().string();
  for (std::size_t at = text.find(path); at != std::string::npos; at = text.find(path, at + name.size())) {
    text.replace(at, path.size(), name);
  }
  return text;
}

void RenderThread::start() {
  thread_ = std::thread([this] { run(); });
}

void RenderThread::end() noexcept {
  if (!thread_.joinable()) return;
  stop(std::chrono::milliseconds(0));
  thread_.join();
  queue_ = {};
}

void RenderThread::submit(const Account& account, RenderJob job) {
  const std::lock_guard lock(mutex_);
  if (ended_) return;
  queue_.add(account, {.order = std::move(job)});
  wake_.notify_all();
}

void RenderThread::load(VolumeId id, VolumeFile file, Answer<RenderResult> done) {
  FrameOrder order{.view = resolveView(View{}, file.info()),
                   .prepare_only = true,
                   .cancel = std::make_shared<std::atomic<bool>>(false)};
  const std::lock_guard lock(mutex_);
  if (ended_) return;
  Held& held = volumes_[id];
  held.file = file.path();
  // Peer 0 is the house: what it loads has the share of one peer.
  queue_.add({.peer = 0, .group = id, .client = id},
             {.order = {.volume = id, .frame = std::move(order), .done = std::move(done)},
              .file = std::move(file),
              .is_load = true});
  held.hold = VolumeHold::loading;
  held.unload = false;
  wake_.notify_all();
}

void RenderThread::wake() noexcept {
  const std::lock_guard lock(mutex_);
  wake_.notify_all();
}

void RenderThread::forget(std::uint64_t owner) {
  const std::lock_guard lock(mutex_);
  forgotten_.push_back(owner);
  wake_.notify_all();
}

RenderStatus RenderThread::status() const {
  const std::lock_guard lock(mutex_);
  RenderStatus status = status_;
  status.jobs = queue_.size();
  return status;
}

std::shared_ptr<const DeviceInfo> RenderThread::device() const {
  const std::lock_guard lock(mutex_);
  return device_;
}

std::map<std::string, std::uint64_t> RenderThread::memoryParts() const {
  const std::lock_guard lock(mutex_);
  return memory_parts_;
}

bool RenderThread::stop(std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  stopping_ = true;
  if (running_ != nullptr && running_->job.order.frame.cancel) running_->job.order.frame.cancel->store(true);
  wake_.notify_all();
  return wake_.wait_for(lock, patience, [this] { return ended_; }) && status_.abandoned == 0;
}

void RenderThread::run() {
  try {
    openDevice();
    device_promise_.set_value();
  } catch (...) {
    device_promise_.set_exception(std::current_exception());
    giveUp(std::current_exception());
  }
  while (renderer_ != nullptr) {
    std::unique_lock lock(mutex_);
    Queue::Entry* entry = nullptr;
    wake_.wait(lock,
               [&] { return stopping_ || has_unloads_ || !forgotten_.empty() || (entry = nextTurn()) != nullptr; });
    if (stopping_) break;
    running_ = entry;
    lock.unlock();
    if (entry != nullptr) {
      takeTurn(*entry);
    } else {
      letGo();
    }
  }
  // Frames end before their volumes, and those before the renderer. The orders stay, for whoever waits to be destroyed
  // with them.
  endAll();
  const std::lock_guard lock(mutex_);
  ended_ = true;
  wake_.notify_all();
}

void RenderThread::openDevice() {
  std::unique_ptr<Renderer> opened = factory_();
  auto info = std::make_shared<const DeviceInfo>(opened->device());
  renderer_ = std::move(opened);
  {
    const std::lock_guard lock(mutex_);
    device_ = std::move(info);
    status_.memory_used_bytes = device_->memory_used_bytes;
  }
  tell(DeviceState::ready);
}

void RenderThread::tell(DeviceState state) noexcept {
  {
    const std::lock_guard lock(mutex_);
    status_.state = state;
  }
  mailbox_.nudge();
}

// Whoever is cancelled goes first, as it only has to end; the others by their turn, and what may come after all of
// them.
RenderThread::Queue::Entry* RenderThread::nextTurn() {
  Queue::Entry* cancelled = nullptr;
  queue_.forEach([&](Queue::Entry& entry) {
    if (isCancelled(entry.job.order.frame)) cancelled = &entry;
  });
  if (cancelled != nullptr) return cancelled;
  const auto next = [this](bool ahead) {
    return queue_.next(
        [&](const Queue::Entry& entry) { return entry.job.order.frame.ahead == ahead && mayRun(entry); });
  };
  Queue::Entry* drawn = next(false);
  return drawn != nullptr ? drawn : next(true);
}

bool RenderThread::mayRun(const Queue::Entry& entry) {
  const auto now = Clock::now();
  if (entry.job.frame != nullptr) {
    // Who waits too long is refused by its turn.
    return !entry.job.frame->waits() || (entry.job.waits_since && now - *entry.job.waits_since > kLongestRoomWait);
  }
  // Who waits for memory is not passed by newcomers, who would take it, for as long as a frame usually takes; and now
  // and then again. Whoever has the memory may take much longer, and that holds up nobody else.
  bool holds_back = false;
  queue_.forEach([&](const Queue::Entry& other) {
    const bool waits = other.job.waits_since && other.job.frame != nullptr && other.job.frame->waits();
    holds_back = holds_back || (waits && (now - *other.job.waits_since) % kHoldBackEvery < kHoldBack);
  });
  if (holds_back) return false;
  if (entry.job.is_load) return true;
  const auto held = volumes_.find(entry.job.order.volume);
  if (held != volumes_.end() && (held->second.hold == VolumeHold::loading || held->second.hold == VolumeHold::lost)) {
    return false;
  }
  if (entry.account.group != kRequests) return true;
  int under_way = 0;
  queue_.forEach([&](const Queue::Entry& other) {
    const bool is_neighbour = other.account.peer == entry.account.peer && other.account.group == kRequests;
    if (is_neighbour && other.job.frame != nullptr) ++under_way;
  });
  return under_way < kRequestsUnderWay;
}

void RenderThread::takeTurn(Queue::Entry& entry) noexcept {
  Job& job = entry.job;
  const auto begin = Clock::now();
  if (!std::exchange(job.had_turn, true)) job.waited_ms = msSince(job.since);
  RenderResult result;
  std::exception_ptr loss;
  bool is_done = true;
  try {
    is_done = !advance(job, result.frame);
    if (is_done || !job.frame->waits()) {
      job.waits_since.reset();
    } else if (!job.waits_since) {
      job.waits_since = Clock::now();
    }
  } catch (const DeviceLost&) {
    loss = result.error = std::current_exception();
  } catch (const ViewError&) {
    result.error = std::current_exception();
  } catch (const VolumeError&) {
    result.error = std::current_exception();
  } catch (const DataError& broken) {
    job.frame.reset();
    result.error = breakVolume(job.order.volume, broken.what());
  } catch (const std::exception& error) {
    result.error = std::current_exception();
    if (job.is_load) {
      job.frame.reset();
      breakVolume(job.order.volume, error.what());
    }
  }
  const double ms = msSince(begin);
  job.took_ms += ms;
  std::optional<Job> done;
  {
    const std::lock_guard lock(mutex_);
    running_ = nullptr;
    if (!job.order.frame.ahead) queue_.charge(entry, ms);  // nobody else wanted that time
    if (is_done) done.emplace(queue_.remove(entry));
  }
  noteMemory();
  if (loss) tell(DeviceState::lost);  // before anyone is answered, who may look
  if (done) {
    if (!loss) done->frame.reset();
    if (done->is_load) finishLoad(done->order.volume, result.error != nullptr);
    result.took_ms = done->took_ms;
    result.waited_ms = done->waited_ms;
    done->order.done(std::move(result));
  }
  if (loss) recover(loss, done ? std::move(done->frame) : nullptr);
}

// One piece. True while there is more to do.
bool RenderThread::advance(Job& job, Frame& frame) {
  if (job.frame == nullptr) {
    if (isCancelled(job.order.frame)) {
      frame.cancelled = true;
      return false;
    }
    startFrame(job);
    if (job.is_load) return true;
  }
  if (job.frame->advance()) return true;
  frame = job.frame->finish();
  return false;
}

void RenderThread::startFrame(Job& job) {
  ResidentVolume* resident = nullptr;
  if (job.is_load) {
    if (!job.file) throw VolumeError("it was let go while it was loaded");
    std::unique_ptr<ResidentVolume> loaded = renderer_->load(std::move(*job.file));
    job.file.reset();
    const std::lock_guard lock(mutex_);
    const auto held = volumes_.find(job.order.volume);
    if (held == volumes_.end()) throw VolumeError("it was let go while it was loaded");
    held->second.resident = std::move(loaded);
    resident = held->second.resident.get();
  } else {
    const std::lock_guard lock(mutex_);
    const auto held = volumes_.find(job.order.volume);
    if (held == volumes_.end()) throw VolumeError("it is not served any more");
    if (held->second.hold == VolumeHold::broken) throw VolumeError(held->second.reason);
    resident = held->second.resident.get();
  }
  job.frame = renderer_->begin(*resident, job.order.frame);
}

void RenderThread::noteMemory() noexcept {
  if (renderer_ == nullptr) return;
  try {
    const std::uint64_t used = renderer_->device().memory_used_bytes;
    if (used == status_.memory_used_bytes) return;  // written by this thread alone
    std::map<std::string, std::uint64_t> parts;
    for (const PartTotal& part : renderer_->parts()) parts[part.what] += part.bytes;
    const std::lock_guard lock(mutex_);
    memory_parts_ = std::move(parts);
    status_.memory_used_bytes = used;
    mailbox_.nudge();
  } catch (const std::exception& error) {
    spdlog::debug("memory is not told of: {}", error.what());  // it is at the next change
  }
}

}  // namespace blockwalk
