// SPDX-License-Identifier: Apache-2.0
// Waiting, on the socket thread, for what another thread does.
#pragma once

#include <boost/asio/async_result.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <exception>
#include <memory>
#include <utility>

#include "server/render/mailbox.h"

// GCC 12 pairs a coroutine frame's operator delete with the wrong operator new when a sanitizer keeps both from
// inlining.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
#endif

namespace blockwalk {

namespace asio = boost::asio;

template <typename Result, typename Handler>
class WaitingCoroutine final : public ResultLetter<Result> {
 public:
  WaitingCoroutine(Mailbox& mailbox, Handler handler) : ResultLetter<Result>(mailbox), handler_(std::move(handler)) {}
  void open() override {
    auto resume = std::move(handler_);
    resume(std::move(*this->result));
  }

 private:
  Handler handler_;
};

// Calls start(answer), where `answer` may be called once from any thread. Resumes on the socket thread with the result.
// What start() throws comes back as the result's `error`. If nobody ever answers the coroutine is destroyed with the
// last copy of `answer`.
template <typename Result, typename Start>
asio::awaitable<Result> awaitResult(Mailbox& mailbox, Start start) {
  co_return co_await asio::async_initiate<decltype(asio::use_awaitable), void(Result)>(
      [&mailbox](auto handler, auto run) {
        const Answer<Result> answer(
            std::make_shared<WaitingCoroutine<Result, decltype(handler)>>(mailbox, std::move(handler)));
        try {
          run(answer);
        } catch (...) {
          Result failed{};
          failed.error = std::current_exception();
          answer(std::move(failed));
        }
      },
      asio::use_awaitable, std::move(start));
}

}  // namespace blockwalk
