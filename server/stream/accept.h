// SPDX-License-Identifier: Apache-2.0
// The opening of a WebSocket.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>

#include "server/base/options.h"
#include "server/stream/outbox.h"

namespace blockwalk {

// Answers an upgrade that was judged before, with the rules for what follows. False where the client is gone.
boost::asio::awaitable<bool> acceptStream(WebSocket& socket,
                                          const boost::beast::http::request<boost::beast::http::string_body>& upgrade,
                                          const ServerOptions& options);

}  // namespace blockwalk
