// SPDX-License-Identifier: Apache-2.0
// What the host computes on a thread of its own, so that whoever waits for it can look up now and then.
#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <system_error>

namespace blockwalk {

// Ends with its thread: destroying it waits. What the work looks at must be its own or shared by it.
template <typename T>
class HostWork {
 public:
  explicit HostWork(std::function<T()> work) {
    try {
      result_ = std::async(std::launch::async, work);
    } catch (const std::system_error&) {  // no thread to be had
      result_ = std::async(std::launch::deferred, std::move(work));
      result_.wait();
    }
  }

  // Waits a little, so that whoever asks again at once does not spin.
  bool isReady() { return taken_ || result_.wait_for(std::chrono::milliseconds(5)) == std::future_status::ready; }
  // Once it is ready. Throws what the work threw.
  T take() {
    taken_ = true;
    return result_.get();
  }

 private:
  std::future<T> result_;
  bool taken_ = false;
};

}  // namespace blockwalk
