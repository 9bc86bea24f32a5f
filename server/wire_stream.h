// SPDX-License-Identifier: Apache-2.0
// The bytes of one connection, plain or through TLS: one stream type, so that requests and streams are written once.
#pragma once

#include <boost/asio/async_result.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/role.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <chrono>
#include <memory>

namespace blockwalk {

// Makes an operation a coroutine's that reports its error in `error` instead of throwing it.
inline auto keepError(boost::system::error_code& error) {
  return boost::asio::redirect_error(boost::asio::use_awaitable, error);
}

// An AsyncStream of Boost.Beast, movable. Timeouts are tcp_stream's and cover TLS too.
class WireStream {
 public:
  using Tcp = boost::beast::tcp_stream;
  using executor_type = Tcp::executor_type;

  // `tls` is null for a plain connection, else it must outlive the stream.
  WireStream(boost::asio::ip::tcp::socket socket, boost::asio::ssl::context* tls)
      : tcp_(std::make_unique<Tcp>(std::move(socket))) {
    if (tls != nullptr) tls_ = std::make_unique<boost::asio::ssl::stream<Tcp&>>(*tcp_, *tls);
  }

  executor_type get_executor() { return tcp_->get_executor(); }
  Tcp& tcp() { return *tcp_; }
  Tcp::socket_type& socket() { return tcp_->socket(); }
  void expires_after(std::chrono::nanoseconds time) { tcp_->expires_after(time); }
  void expires_never() { tcp_->expires_never(); }
  void close() { tcp_->close(); }

  // The TLS handshake; nothing for a plain connection. Reports what went wrong.
  boost::asio::awaitable<boost::system::error_code> handshake() {
    boost::system::error_code error;
    if (tls_) {
      co_await tls_->async_handshake(boost::asio::ssl::stream_base::server, keepError(error));
    }
    co_return error;
  }

  // Says goodbye in TLS, so that the client knows that nothing was cut off; then no more is sent.
  boost::asio::awaitable<void> endSending() {
    boost::system::error_code ignored;  // the client may be gone already
    if (tls_) co_await tls_->async_shutdown(keepError(ignored));
    tcp_->socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
  }

  template <typename Buffers, typename Token>
  auto async_read_some(const Buffers& buffers, Token&& token) {
    return boost::asio::async_initiate<Token, void(boost::system::error_code, std::size_t)>(
        [this](auto handler, const Buffers& into) {
          if (tls_) {
            tls_->async_read_some(into, std::move(handler));
          } else {
            tcp_->async_read_some(into, std::move(handler));
          }
        },
        token, buffers);
  }

  template <typename Buffers, typename Token>
  auto async_write_some(const Buffers& buffers, Token&& token) {
    return boost::asio::async_initiate<Token, void(boost::system::error_code, std::size_t)>(
        [this](auto handler, const Buffers& from) {
          if (tls_) {
            tls_->async_write_some(from, std::move(handler));
          } else {
            tcp_->async_write_some(from, std::move(handler));
          }
        },
        token, buffers);
  }

 private:
  std::unique_ptr<Tcp> tcp_;  // not in place: the TLS stream points at it, and a WireStream moves
  std::unique_ptr<boost::asio::ssl::stream<Tcp&>> tls_;
};

// What Beast's WebSocket asks of its stream when a connection ends.
inline void beast_close_socket(WireStream& stream) { stream.close(); }

template <typename Handler>
void async_teardown(boost::beast::role_type role, WireStream& stream, Handler&& handler) {
  using boost::beast::websocket::async_teardown;
  async_teardown(role, stream.socket(), std::forward<Handler>(handler));
}

inline void teardown(boost::beast::role_type role, WireStream& stream, boost::system::error_code& error) {
  using boost::beast::websocket::teardown;
  teardown(role, stream.socket(), error);
}

}  // namespace blockwalk
