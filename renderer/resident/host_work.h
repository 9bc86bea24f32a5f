// SPDX-License-Identifier: Apache-2.0
// What the host computes on a thread of its own, so that whoever waits for it can look up now and then.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <system_error>
#include <thread>
#include <utility>

namespace blockwalk {

// Threads of works under way, of the process: those that nobody waits for any more too.
inline std::atomic<int> host_works{0};
inline constexpr int kMostHostWorks = 8;

// Destroying it does not wait: the work goes on, for nobody. What it looks at must be its own or shared by it, and of
// the host alone: the device may be gone before it ends. Where as many threads as may be are at work it begins later.
template <typename T>
class HostWork {
 public:
  explicit HostWork(std::function<T()> work)
      : task_(std::make_shared<std::packaged_task<T()>>(std::move(work))), result_(task_->get_future()) {
    start();
  }

  // Waits a little, so that whoever asks again at once does not spin.
  bool isReady() { return isReadyWithin(std::chrono::milliseconds(5)); }
  bool isReadyWithin(std::chrono::milliseconds time) {
    if (taken_) return true;
    if (task_ != nullptr) start();
    return result_.wait_for(time) == std::future_status::ready;
  }
  // Once it is ready. Throws what the work threw.
  T take() {
    taken_ = true;
    return result_.get();
  }

 private:
  void start() {
    if (host_works.fetch_add(1) >= kMostHostWorks) {
      --host_works;
      return;
    }
    try {
      std::thread([task = task_] {
        (*task)();
        --host_works;
      }).detach();
    } catch (const std::system_error&) {  // no thread to be had
      --host_works;
      (*task_)();
    }
    task_.reset();
  }

  std::shared_ptr<std::packaged_task<T()>> task_;  // until it has begun
  std::future<T> result_;
  bool taken_ = false;
};

}  // namespace blockwalk
