// SPDX-License-Identifier: Apache-2.0
// One WebSocket of subprotocol blockwalk.v1: loops that read messages, draw, have encoded and write, side by side.
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
