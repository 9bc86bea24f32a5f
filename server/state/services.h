// SPDX-License-Identifier: Apache-2.0
// What every connection and stream of the socket thread works with.
#pragma once

#include <boost/asio/ssl/context.hpp>
#include <memory>
#include <set>

#include "server/base/counted.h"
#include "server/base/peer_places.h"
#include "server/http/waiting_connections.h"
#include "server/region/region_maker.h"
#include "server/render/frame_maker.h"
#include "server/state/server_state.h"

namespace blockwalk {

// A stream as the server sees it.
class OpenStream {
 public:
  virtual ~OpenStream() = default;
  virtual const ServedVolume& volume() const = 0;
  virtual std::uint64_t peer() const = 0;
  // The frame under way is sent, then the stream closes: with 1001, as the server ends, or with 1012, as the file of
  // its volume was replaced.
  virtual void goAway() = 0;
  virtual void volumeReplaced() = 0;
};

struct Services {
  ServerState& state;
  FrameMaker& frames;
  RegionMaker& regions;
  std::shared_ptr<boost::asio::ssl::context> tls = {};  // null: plain connections
  WaitingConnections waiting = {};
  PeerPlaces animations{4, 2};  // at a time, and of one peer
  std::set<OpenStream*> streams = {};
  Count busy = {};  // requests being served, and streams
};

}  // namespace blockwalk
