// SPDX-License-Identifier: Apache-2.0
// What every connection of the socket thread shares.
#pragma once

#include <boost/asio/ssl/context.hpp>
#include <functional>
#include <memory>
#include <set>

#include "server/render/frame_maker.h"
#include "server/server_state.h"

namespace blockwalk {

// A stream as the server sees it when it ends.
class OpenStream {
 public:
  virtual ~OpenStream() = default;
  // The frame under way is sent, then the stream closes with 1001.
  virtual void goAway() = 0;
};

struct ServerContext {
  ServerState& state;
  FrameMaker& frames;
  std::shared_ptr<boost::asio::ssl::context> tls = {};  // null: plain connections
  std::set<OpenStream*> streams = {};
  int busy = 0;                            // requests being served, and streams
  std::function<void()> on_not_busy = {};  // busy became 0
};

// Counts a request or a stream as long as it lives.
class BusyLease {
 public:
  explicit BusyLease(ServerContext& context) : context_(context) { ++context_.busy; }
  ~BusyLease() {
    if (--context_.busy == 0 && context_.on_not_busy) context_.on_not_busy();
  }
  BusyLease(const BusyLease&) = delete;
  BusyLease& operator=(const BusyLease&) = delete;

 private:
  ServerContext& context_;
};

// One of the max_sessions places, taken before the handshake, which waits for the client.
class SessionPlace {
 public:
  explicit SessionPlace(ServerContext& context) : counters_(context.state.counters) { ++counters_.open_sessions; }
  ~SessionPlace() { --counters_.open_sessions; }
  SessionPlace(const SessionPlace&) = delete;
  SessionPlace& operator=(const SessionPlace&) = delete;

 private:
  ServerCounters& counters_;
};

}  // namespace blockwalk
