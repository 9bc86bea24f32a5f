// SPDX-License-Identifier: Apache-2.0
#include "server/stream/accept.h"

#include <boost/beast/websocket.hpp>

#include "protocol/stream_messages.h"

namespace blockwalk {

namespace beast = boost::beast;
namespace websocket = beast::websocket;

boost::asio::awaitable<bool> acceptStream(WebSocket& socket,
                                          const beast::http::request<beast::http::string_body>& upgrade,
                                          const ServerOptions& options) {
  socket.set_option(websocket::stream_base::timeout{.handshake_timeout = std::chrono::seconds(options.header_time),
                                                    .idle_timeout = std::chrono::seconds(options.idle_time),
                                                    .keep_alive_pings = true});
  socket.set_option(websocket::stream_base::decorator([](websocket::response_type& response) {
    response.set(beast::http::field::sec_websocket_protocol, kStreamProtocol);
  }));
  socket.read_message_max(kMaxMessageBytes);
  socket.auto_fragment(false);  // the session cuts messages itself
  boost::system::error_code error;
  co_await socket.async_accept(upgrade, keepError(error));
  if (error) co_return false;
  beast::get_lowest_layer(socket).socket().set_option(boost::asio::ip::tcp::no_delay(true), error);
  co_return true;
}

}  // namespace blockwalk
