// SPDX-License-Identifier: Apache-2.0
// The writing side of a stream: a few short texts and a slot for one frame wait to be written; never a growing queue.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/websocket.hpp>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/http/wire_stream.h"
#include "server/render/await_result.h"
#include "server/server_context.h"

namespace blockwalk {

// Frames are compressed already: without deflate.
using WebSocket = boost::beast::websocket::stream<WireStream, false>;

struct OutFrame {
  std::vector<std::byte> message;
  std::string text_after;      // is sent right after it, unless empty
  std::shared_ptr<void> room;  // held while the message is: see ServerState::pending_pixels
};

// Belongs to the socket thread, and to a session that owns the socket and outlives write().
class StreamOutbox {
 public:
  static constexpr std::size_t kMaxWaitingTexts = 16;

  // `on_room` is called when a text or the frame has left its place.
  StreamOutbox(WebSocket& socket, ServerContext& context, std::function<void()> on_room);

  // Texts are short and are the answers to what a client sent; reading pauses while there are too many.
  void push(std::string text);
  bool isCrowded() const { return texts_.size() >= kMaxWaitingTexts; }
  // The slot must be free.
  void put(OutFrame frame);
  bool hasFrame() const { return frame_.has_value(); }

  // Writes what waits, and then the close frame once there is a code and `is_drawing()` is over. A client that takes
  // nothing for the send time is cut off. `owner` keeps the session, and with it this, alive.
  boost::asio::awaitable<void> write(std::shared_ptr<const void> owner, std::function<bool()> is_drawing);
  void close(boost::beast::websocket::close_code code);
  // Something that write() waits for may have changed.
  void wake() { signal_.notify(); }
  // The client is gone: what waits is dropped and the socket closed.
  void abandon();

 private:
  boost::asio::awaitable<bool> send(boost::asio::const_buffer bytes, bool text, std::weak_ptr<const void> owner);

  WebSocket& socket_;
  ServerContext& context_;
  std::function<void()> on_room_;
  std::deque<std::string> texts_;
  std::optional<OutFrame> frame_;
  std::optional<boost::beast::websocket::close_code> closing_;
  bool abandoned_ = false;
  Signal signal_;
  boost::asio::steady_timer send_timer_;
};

}  // namespace blockwalk
