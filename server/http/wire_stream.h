// SPDX-License-Identifier: Apache-2.0
// The bytes of one connection, plain or through TLS: one stream type, so that requests and streams are written once.
#pragma once

#include <array>
#include <boost/asio/any_completion_handler.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/role.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string_view>

namespace boost::asio::ssl {
template <typename Stream>
class stream;
}

namespace blockwalk {

namespace asio = boost::asio;

// Makes an operation a coroutine's that reports its error in `error` instead of throwing it.
inline auto keepError(boost::system::error_code& error) {
  return boost::asio::redirect_error(boost::asio::use_awaitable, error);
}

// The first pieces of a buffer sequence that are not empty. What reads or writes "some" bytes may do with these.
template <typename Piece>
class FirstPieces {
 public:
  using value_type = Piece;
  using const_iterator = const Piece*;

  template <typename Buffers>
  explicit FirstPieces(const Buffers& buffers) {
    const auto end = boost::asio::buffer_sequence_end(buffers);
    for (auto it = boost::asio::buffer_sequence_begin(buffers); it != end && count_ < pieces_.size(); ++it) {
      const Piece piece(*it);
      if (piece.size() > 0) pieces_[count_++] = piece;
    }
  }
  const_iterator begin() const { return pieces_.data(); }
  const_iterator end() const { return pieces_.data() + count_; }

 private:
  std::array<Piece, 4> pieces_{};
  std::size_t count_ = 0;
};

// An AsyncStream of Boost.Beast, movable. Timeouts are tcp_stream's and cover TLS too. Handlers lose their type here:
// TCP and TLS are compiled once, and not again for each operation of HTTP and WebSocket.
class WireStream {
 public:
  using Tcp = boost::beast::tcp_stream;
  using executor_type = Tcp::executor_type;

  // `tls` is null for a plain connection.
  WireStream(boost::asio::ip::tcp::socket socket, std::shared_ptr<boost::asio::ssl::context> tls);
  WireStream(WireStream&&) noexcept;
  WireStream& operator=(WireStream&&) noexcept;
  ~WireStream();

  executor_type get_executor() { return tcp_->get_executor(); }
  Tcp::socket_type& socket() { return tcp_->socket(); }
  void expires_after(std::chrono::nanoseconds time) { tcp_->expires_after(time); }
  void expires_never() { tcp_->expires_never(); }
  void close() { tcp_->close(); }

  // Bytes that were written and that the client has not taken yet, as far as the kernel knows.
  std::uint64_t unsentBytes();
  enum class Peer { there, ended_sending, gone };
  Peer peerState();
  bool isTls() const { return tls_ != nullptr; }
  // Of a plain connection with no write under way. Whether the kernel took all bytes at once.
  bool sendNow(std::string_view bytes);

  // The TLS handshake; nothing for a plain connection. Reports what went wrong.
  boost::asio::awaitable<boost::system::error_code> handshake();

  // Says goodbye in TLS, so that the client knows that nothing was cut off; then no more is sent.
  boost::asio::awaitable<void> endSending();

  template <typename Buffers, typename Token>
  auto async_read_some(const Buffers& buffers, Token&& token) {
    return boost::asio::async_initiate<Token, void(boost::system::error_code, std::size_t)>(
        [this](auto handler, const Into& into) { startReading(into, std::move(handler)); }, token, Into(buffers));
  }

  template <typename Buffers, typename Token>
  auto async_write_some(const Buffers& buffers, Token&& token) {
    return boost::asio::async_initiate<Token, void(boost::system::error_code, std::size_t)>(
        [this](auto handler, const From& from) { startWriting(from, std::move(handler)); }, token, From(buffers));
  }

 private:
  using Into = FirstPieces<boost::asio::mutable_buffer>;
  using From = FirstPieces<boost::asio::const_buffer>;
  using Handler = boost::asio::any_completion_handler<void(boost::system::error_code, std::size_t)>;

  void startReading(const Into& into, Handler handler);
  void startWriting(const From& from, Handler handler);

  std::shared_ptr<boost::asio::ssl::context> context_;  // which may be replaced meanwhile
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
