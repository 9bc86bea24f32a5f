// SPDX-License-Identifier: Apache-2.0
#include "server/stream/outbox.h"

#include <algorithm>
#include <utility>

#include "server/http/send_watch.h"
#include "volume/error.h"

namespace blockwalk {
namespace {

namespace beast = boost::beast;
using boost::system::error_code;

constexpr std::size_t kFragmentBytes = std::size_t{64} << 10;

// Takes up to `count` bytes off the front.
asio::const_buffer take(asio::const_buffer& bytes, std::size_t count) {
  const asio::const_buffer taken = asio::buffer(bytes, count);
  bytes += taken.size();
  return taken;
}

}  // namespace

StreamOutbox::StreamOutbox(WebSocket& socket, Services& services, std::function<void()> on_room)
    : socket_(socket), services_(services), on_room_(std::move(on_room)), signal_(socket.get_executor()) {}

void StreamOutbox::push(std::string text) {
  texts_.push_back(std::move(text));
  signal_.notify();
}

void StreamOutbox::put(OutFrame frame) {
  BLOCKWALK_CHECK(frame_.has_value(), ==, false);
  frame_ = std::move(frame);
  signal_.notify();
}

void StreamOutbox::finish(beast::websocket::close_code code) {
  last_ = code;
  signal_.notify();
}

void StreamOutbox::abandon() {
  abandoned_ = true;
  texts_.clear();
  frame_.reset();
  beast::get_lowest_layer(socket_).close();
  signal_.notify();
}

// One message, in fragments, so that what has left is known on the way.
asio::awaitable<bool> StreamOutbox::send(bool text, asio::const_buffer head, asio::const_buffer rest) {
  socket_.text(text);
  SendWatch watch(beast::get_lowest_layer(socket_), sendBounds(services_.state.options));
  error_code error;
  do {
    std::array<asio::const_buffer, 2> fragment;
    fragment[0] = take(head, kFragmentBytes);
    fragment[1] = take(rest, kFragmentBytes - fragment[0].size());
    const std::size_t size = asio::buffer_size(fragment);
    const bool is_last = head.size() + rest.size() == 0;
    co_await socket_.async_write_some(is_last, fragment, keepError(error));
    watch.wrote(size);
    services_.state.counters.sent_bytes += size;
  } while (!error && head.size() + rest.size() > 0);
  co_return !error;
}

asio::awaitable<void> StreamOutbox::write() {
  bool sent = true;
  while (sent && !abandoned_) {
    if (!texts_.empty()) {
      const std::string text = std::move(texts_.front());
      texts_.pop_front();
      on_room_();
      sent = co_await send(true, asio::buffer(text));
    } else if (frame_) {
      const OutFrame frame = std::move(*frame_);
      frame_.reset();
      on_room_();
      sent = co_await send(false, asio::buffer(frame.head), asio::buffer(frame.image.view.data(), frame.image.size()));
      // In a statement of its own: GCC 12 awaits the right side of && whatever the left one says.
      if (sent && !frame.text_after.empty()) sent = co_await send(true, asio::buffer(frame.text_after));
    } else if (last_) {
      break;
    } else {
      co_await signal_.wait();
    }
  }
  if (abandoned_) co_return;
  error_code error;
  if (sent) co_await socket_.async_close(beast::websocket::close_reason(*last_), keepError(error));
  if (!sent || error) beast::get_lowest_layer(socket_).close();
}

}  // namespace blockwalk
