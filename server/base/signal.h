// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <chrono>

namespace blockwalk {

namespace asio = boost::asio;

// Wakes one coroutine of the same thread. What it waits for is checked before waiting, and nothing runs in between, so
// no wake-up is lost.
class Signal {
 public:
  explicit Signal(const asio::any_io_executor& executor) : timer_(executor) {}

  void notify() { timer_.cancel(); }
  // Returns when notified, or at `when`.
  asio::awaitable<void> wait(
      std::chrono::steady_clock::time_point when = std::chrono::steady_clock::time_point::max()) {
    timer_.expires_at(when);
    boost::system::error_code ignored;  // cancelled: notified
    co_await timer_.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
  }

 private:
  asio::steady_timer timer_;
};

}  // namespace blockwalk
