// SPDX-License-Identifier: Apache-2.0
// One WebSocket of subprotocol blockwalk.v1: a loop that reads messages, one that draws, one that writes.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <cstdint>
#include <memory>

#include "server/http/wire_stream.h"
#include "server/state/services.h"

namespace blockwalk {

// Answers the upgrade, which was judged before, and serves until either side closes. The volume is ready.
boost::asio::awaitable<void> serveStream(WireStream stream,
                                         boost::beast::http::request<boost::beast::http::string_body> upgrade,
                                         Services& services, std::shared_ptr<const ServedVolume> volume,
                                         std::uint64_t peer);

}  // namespace blockwalk
