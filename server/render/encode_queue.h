// SPDX-License-Identifier: Apache-2.0
// Who may encode when, on the threads of a pool. A picture that is being encoded cannot be interrupted, and a large one
// takes seconds: those that take long leave a thread to the others, where there are two. Who waits goes by the time
// that was used, as on the device. Belongs to the socket thread.
#pragma once

#include <boost/asio/thread_pool.hpp>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>

#include "protocol/image_codec.h"
#include "server/render/fair_queue.h"

namespace blockwalk {

class EncodeQueue {
 public:
  // Encodes and answers, on one of the threads; or, given an error, answers with that. Must not throw.
  using Encode = std::function<void(std::exception_ptr)>;
  struct Job {
    Encode encode;
    bool is_long = false;
    bool is_running = false;
  };
  using Place = FairQueue<Job>::Entry;

  EncodeQueue(boost::asio::thread_pool& threads, std::size_t count) : threads_(threads), count_(count) {}

  // The place is held until finish(), which follows the answer. What throws leaves none behind.
  Place& add(const Account& account, bool is_long, Encode encode);
  void finish(Place& place, double ms) noexcept;
  // After the threads have ended: drops all, unanswered.
  void end() noexcept;

  // More than some 50 ms of a core.
  static bool takesLong(ImageFormat format, std::int64_t pixels);

 private:
  static void run(Place& place, std::exception_ptr error) noexcept;
  bool mayRun(const Place& place) const;
  void startNext() noexcept;

  boost::asio::thread_pool& threads_;
  std::size_t count_;
  std::size_t running_ = 0;
  std::size_t long_running_ = 0;
  FairQueue<Job> queue_;
};

}  // namespace blockwalk
