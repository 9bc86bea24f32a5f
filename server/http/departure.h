// SPDX-License-Identifier: Apache-2.0
// Notices that a client has gone while its picture is being made.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>

#include "server/http/wire_stream.h"

namespace blockwalk {

// Calls `on_gone` once when the client has closed, looking every 50 ms: whether it has sent more, which pipelining may,
// says nothing. A client that ended its sending with its request (a half close) still waits for the reply; only a reset
// tells that it is gone. The stream must outlive it.
class DepartureWatch {
 public:
  DepartureWatch(WireStream& stream, std::function<void()> on_gone);
  ~DepartureWatch();
  DepartureWatch(const DepartureWatch&) = delete;
  DepartureWatch& operator=(const DepartureWatch&) = delete;

 private:
  struct State {
    WireStream* stream;  // null: nobody watches any more
    std::function<void()> on_gone;
    boost::asio::steady_timer timer;
    bool is_first = true;
    bool has_half_closed = false;
  };
  static void lookLater(std::shared_ptr<State> state);

  std::shared_ptr<State> state_;
};

}  // namespace blockwalk
