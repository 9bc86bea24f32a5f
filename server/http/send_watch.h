// SPDX-License-Identifier: Apache-2.0
// Cuts off who takes what is sent too slowly, so that it cannot hold what the reply holds.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdint>
#include <memory>

#include "server/base/options.h"
#include "server/http/wire_stream.h"

namespace blockwalk {

// What a client must take: over the whole of a reply or a frame at least a rate, after a time that is its own; and
// never nothing for that time. Judged by the bytes that have left this machine, not by those that wait in the kernel,
// where a slow client's megabytes come and go in jumps.
struct SendBounds {
  std::chrono::steady_clock::duration patience{};
  double bytes_per_second = 0;
};

SendBounds sendBounds(const ServerOptions& options);

class SendRate {
 public:
  using Clock = std::chrono::steady_clock;

  SendRate(const SendBounds& bounds, Clock::time_point begin) : bounds_(bounds), begin_(begin), progress_(begin) {}

  // `left`: of the bytes so far; also right when asked seldom.
  bool isTooSlow(std::uint64_t left, Clock::time_point now);

 private:
  SendBounds bounds_;
  Clock::time_point begin_;
  Clock::time_point progress_;  // when more had left for the last time
  std::uint64_t left_ = 0;
};

// Looks at a stream while something is being sent on it, and closes it when that is too slow. The stream must outlive
// it.
class SendWatch {
 public:
  SendWatch(WireStream& stream, const SendBounds& bounds);
  ~SendWatch();
  SendWatch(const SendWatch&) = delete;
  SendWatch& operator=(const SendWatch&) = delete;

  // The kernel has taken so many bytes more.
  void wrote(std::size_t bytes) { state_->written += bytes; }

 private:
  struct State {
    explicit State(WireStream& watched, const SendBounds& bounds);
    WireStream* stream;  // null: nobody watches any more
    SendRate rate;
    std::uint64_t written = 0;
    boost::asio::steady_timer timer;
  };
  static void lookLater(std::shared_ptr<State> state);

  std::shared_ptr<State> state_;
};

}  // namespace blockwalk
