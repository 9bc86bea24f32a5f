// SPDX-License-Identifier: Apache-2.0
#include "volume/build/workers.h"

#include <algorithm>
#include <system_error>

namespace blockwalk {

Workers::Workers(int threads) {
  try {
    for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
  } catch (const std::system_error&) {
    if (threads_.empty()) throw;
  }
}

Workers::~Workers() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void Workers::start(std::function<void()> job) {
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::move(job));
  }
  changed_.notify_one();
}

void Workers::work() {
  for (;;) {
    std::function<void()> job;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return ending_ || !jobs_.empty(); });
      if (jobs_.empty()) return;
      job = std::move(jobs_.front());
      jobs_.pop_front();
    }
    job();
  }
}

int workerCount(std::uint64_t memory_bytes, int processors) {
  constexpr std::uint64_t kMostThreads = 8;
  constexpr std::uint64_t kMemoryEach = std::uint64_t{64} << 20;
  const auto most = static_cast<std::uint64_t>(std::max(processors, 1));
  return static_cast<int>(std::clamp<std::uint64_t>(memory_bytes / kMemoryEach, 1, std::min(kMostThreads, most)));
}

}  // namespace blockwalk
