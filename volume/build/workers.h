// SPDX-License-Identifier: Apache-2.0
// What a build does beside its own thread: jobs that share nothing but what they read, whose results come back in the
// order in which they were started, so that a file does not depend on how many threads made it.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace blockwalk {

// Threads that take jobs from one queue. Throws std::system_error when none can be started; fewer than asked for do.
class Workers {
 public:
  explicit Workers(int threads);
  ~Workers();  // waits for every job
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  int threads() const { return static_cast<int>(threads_.size()); }
  void start(std::function<void()> job);

 private:
  void work();

  std::mutex mutex_;  // of the two below
  std::condition_variable changed_;
  std::deque<std::function<void()>> jobs_;
  bool ending_ = false;
  std::vector<std::thread> threads_;
};

// As many as there are `processors`, fewer where `memory_bytes` are few, at most 8.
int workerCount(std::uint64_t memory_bytes, int processors);

// Jobs on workers, at most so many begun that their results fit. Of one thread.
template <typename Result>
class JobsInOrder {
 public:
  explicit JobsInOrder(Workers& workers) : workers_(workers) {}
  // Waits for the jobs: what they refer to may go away behind this.
  ~JobsInOrder() {
    for (const std::future<Result>& result : results_) result.wait();
  }
  JobsInOrder(const JobsInOrder&) = delete;
  JobsInOrder& operator=(const JobsInOrder&) = delete;

  bool empty() const { return results_.empty(); }
  // Whether a result must be taken before another job is started: two jobs for each thread, so that none waits for the
  // one whose turn it is.
  bool full() const { return results_.size() >= 2 * static_cast<std::size_t>(workers_.threads()); }

  template <typename Job>
  void start(Job job) {
    auto task = std::make_shared<std::packaged_task<Result()>>(std::move(job));
    results_.push_back(task->get_future());
    workers_.start([task] { (*task)(); });
  }
  // The oldest job's result, or what it threw.
  Result take() {
    std::future<Result> oldest = std::move(results_.front());
    results_.pop_front();
    return oldest.get();
  }

 private:
  Workers& workers_;
  std::deque<std::future<Result>> results_;
};

}  // namespace blockwalk
