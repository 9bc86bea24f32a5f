// SPDX-License-Identifier: Apache-2.0
// Notices that a client has gone while its picture is being made.
#pragma once

#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <memory>

#include "server/http/wire_stream.h"

namespace blockwalk {

// Calls `on_gone` once when the client has closed, looking every 50 ms: whether it has sent more, which pipelining may,
// says nothing. A client that ended its sending with its request may have closed whole, or half and waits for the
// reply: an interim reply (102, RFC 9110, 15.2) is sent once, which a socket that is closed answers with a reset.
// HTTP/1.0 knows no interim replies, and through TLS nobody half closes: there the end of sending is the end. The
// stream must outlive it.
class DepartureWatch {
 public:
  DepartureWatch(WireStream& stream, int http_version, std::function<void()> on_gone);
  ~DepartureWatch();
  DepartureWatch(const DepartureWatch&) = delete;
  DepartureWatch& operator=(const DepartureWatch&) = delete;

 private:
  struct State {
    WireStream* stream;  // null: nobody watches any more
    std::function<void()> on_gone;
    boost::asio::steady_timer timer;
    bool takes_interim;
    bool has_half_closed = false;
  };
  static bool isGone(State& state);
  static void lookLater(std::shared_ptr<State> state);

  std::shared_ptr<State> state_;
};

}  // namespace blockwalk
