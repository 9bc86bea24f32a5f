// SPDX-License-Identifier: Apache-2.0
// One HTTP connection: requests in order, one at a time, until it closes or becomes a stream.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>

#include "server/state/services.h"

namespace blockwalk {

// Owns the socket. Ends when the client does, at the first request whose framing is in doubt, or when a time is up.
boost::asio::awaitable<void> serveConnection(boost::asio::ip::tcp::socket socket, Services& services);

}  // namespace blockwalk
