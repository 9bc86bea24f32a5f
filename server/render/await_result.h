// SPDX-License-Identifier: Apache-2.0
// Waiting, on the socket thread, for what another thread does.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <chrono>
#include <functional>
#include <memory>

// GCC 12 pairs a coroutine frame's operator delete with the wrong operator new when a sanitizer keeps both from
// inlining.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
#endif

namespace blockwalk {

namespace asio = boost::asio;

// Calls start(done); `done(result)` may be called once from any thread. Resumes on the caller's executor with the
// result. If `done` is never called the coroutine is destroyed with its io_context.
template <typename Result, typename Start>
asio::awaitable<Result> awaitResult(Start start) {
  const auto executor = co_await asio::this_coro::executor;
  co_return co_await asio::async_initiate<decltype(asio::use_awaitable), void(Result)>(
      [executor](auto handler, auto run) {
        auto shared = std::make_shared<decltype(handler)>(std::move(handler));
        run(std::function<void(Result)>([executor, shared](Result result) {
          asio::post(executor, [shared, kept = std::move(result)]() mutable {
            // Moved out first: the thread that called `done` may hold the last reference to `shared`.
            auto resume = std::move(*shared);
            resume(std::move(kept));
          });
        }));
      },
      asio::use_awaitable, std::move(start));
}

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
