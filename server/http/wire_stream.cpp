// SPDX-License-Identifier: Apache-2.0
#include "server/http/wire_stream.h"

#include <linux/sockios.h>
#include <poll.h>
#include <sys/ioctl.h>

#include <boost/asio/bind_executor.hpp>
#include <boost/asio/ssl/stream.hpp>

namespace blockwalk {

using boost::system::error_code;

WireStream::WireStream(asio::ip::tcp::socket socket, std::shared_ptr<asio::ssl::context> tls)
    : context_(std::move(tls)), tcp_(std::make_unique<Tcp>(std::move(socket))) {
  if (context_ != nullptr) tls_ = std::make_unique<asio::ssl::stream<Tcp&>>(*tcp_, *context_);
}

WireStream::WireStream(WireStream&&) noexcept = default;
WireStream& WireStream::operator=(WireStream&&) noexcept = default;
WireStream::~WireStream() = default;

std::uint64_t WireStream::unsentBytes() {
  int bytes = 0;
  if (::ioctl(socket().native_handle(), SIOCOUTQ, &bytes) != 0) return 0;  // it is closed
  return static_cast<std::uint64_t>(bytes);
}

WireStream::Peer WireStream::peerState() {
  pollfd state{.fd = socket().native_handle(), .events = POLLRDHUP, .revents = 0};
  if (::poll(&state, 1, 0) <= 0) return Peer::there;
  if ((state.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0) return Peer::gone;
  return Peer::ended_sending;
}

bool WireStream::sendNow(std::string_view bytes) {
  const ssize_t sent = ::send(socket().native_handle(), bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
  return sent == static_cast<ssize_t>(bytes.size());
}

asio::awaitable<error_code> WireStream::handshake() {
  error_code error;
  if (tls_) co_await tls_->async_handshake(asio::ssl::stream_base::server, keepError(error));
  co_return error;
}

asio::awaitable<void> WireStream::endSending() {
  error_code ignored;  // the client may be gone already
  if (tls_) co_await tls_->async_shutdown(keepError(ignored));
  tcp_->socket().shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
}

// Everything of a connection runs on the stream's executor. Saying so spares any_completion_handler's own executor, of
// which Beast asks what it cannot do.
void WireStream::startReading(const Into& into, Handler handler) {
  auto done = asio::bind_executor(get_executor(), std::move(handler));
  if (tls_) {
    tls_->async_read_some(into, std::move(done));
  } else {
    tcp_->async_read_some(into, std::move(done));
  }
}

void WireStream::startWriting(const From& from, Handler handler) {
  auto done = asio::bind_executor(get_executor(), std::move(handler));
  if (tls_) {
    tls_->async_write_some(from, std::move(done));
  } else {
    tcp_->async_write_some(from, std::move(done));
  }
}

}  // namespace blockwalk
