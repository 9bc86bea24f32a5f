// SPDX-License-Identifier: Apache-2.0
#include "server/stream/outbox.h"

#include <spdlog/spdlog.h>

#include <utility>

#include "volume/error.h"

namespace blockwalk {
namespace {

namespace beast = boost::beast;
using boost::system::error_code;

constexpr std::size_t kFragmentBytes = std::size_t{256} << 10;

}  // namespace

StreamOutbox::StreamOutbox(WebSocket& socket, ServerContext& context, std::function<void()> on_room)
    : socket_(socket),
      context_(context),
      on_room_(std::move(on_room)),
      signal_(socket.get_executor()),
      send_timer_(socket.get_executor()) {}

void StreamOutbox::push(std::string text) {
  texts_.push_back(std::move(text));
  signal_.notify();
}

void StreamOutbox::put(OutFrame frame) {
  BLOCKWALK_CHECK(frame_.has_value(), ==, false);
  frame_ = std::move(frame);
  signal_.notify();
}

void StreamOutbox::close(beast::websocket::close_code code) {
  if (!closing_) closing_ = code;
  signal_.notify();
}

void StreamOutbox::abandon() {
  abandoned_ = true;
  texts_.clear();
  frame_.reset();
  send_timer_.cancel();
  beast::get_lowest_layer(socket_).close();
  signal_.notify();
}

// In fragments, so that a slow client has the send time for each and not for the whole.
asio::awaitable<bool> StreamOutbox::send(asio::const_buffer bytes, bool text, std::weak_ptr<const void> owner) {
  socket_.text(text);
  context_.state.counters.sent_bytes += bytes.size();
  error_code error;
  do {
    const asio::const_buffer fragment = asio::buffer(bytes, kFragmentBytes);
    bytes += fragment.size();
    send_timer_.expires_after(std::chrono::seconds(context_.state.options.send_time));
    send_timer_.async_wait([this, owner](error_code cancelled) {
      const auto alive = owner.lock();
      if (cancelled || !alive) return;
      spdlog::info("stream closed: the client took nothing for the send time");
      beast::get_lowest_layer(socket_).close();
    });
    co_await socket_.async_write_some(bytes.size() == 0, fragment, keepError(error));
    send_timer_.cancel();
  } while (!error && bytes.size() > 0);
  co_return !error;
}

asio::awaitable<void> StreamOutbox::write(std::shared_ptr<const void> owner, std::function<bool()> is_drawing) {
  bool sent = true;
  while (sent && !abandoned_) {
    if (!texts_.empty()) {
      const std::string text = std::move(texts_.front());
      texts_.pop_front();
      on_room_();
      sent = co_await send(asio::buffer(text), true, owner);
    } else if (frame_) {
      const OutFrame frame = std::move(*frame_);
      frame_.reset();
      on_room_();
      sent = co_await send(asio::buffer(frame.message), false, owner);
      // In a statement of its own: GCC 12 awaits the right side of && whatever the left one says.
      if (sent && !frame.text_after.empty()) sent = co_await send(asio::buffer(frame.text_after), true, owner);
    } else if (closing_ && !is_drawing()) {
      break;
    } else {
      co_await signal_.wait();
    }
  }
  if (abandoned_) co_return;
  error_code error;
  if (sent) co_await socket_.async_close(beast::websocket::close_reason(*closing_), keepError(error));
  if (!sent || error) beast::get_lowest_layer(socket_).close();
}

}  // namespace blockwalk
