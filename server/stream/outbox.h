// SPDX-License-Identifier: Apache-2.0
// The writing side of a stream: a few short texts and a slot for one frame wait to be written; never a growing queue.
#pragma once

#include <array>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/beast/websocket.hpp>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/base/signal.h"
#include "server/http/wire_stream.h"
#include "server/state/services.h"
#include "server/stream/out_frame.h"

namespace blockwalk {

// Frames are compressed already: without deflate.
using WebSocket = boost::beast::websocket::stream<WireStream, false>;

// Belongs to the socket thread, and to a session that owns the socket and outlives write().
class StreamOutbox {
 public:
  static constexpr std::size_t kMaxWaitingTexts = 16;

  // `on_room` is called when a text or the frame has left its place.
  StreamOutbox(WebSocket& socket, Services& services, std::function<void()> on_room);

  // Texts are short and are the answers to what a client sent; reading pauses while there are too many.
  void push(std::string text);
  bool isCrowded() const { return texts_.size() >= kMaxWaitingTexts; }
  // The slot must be free.
  void put(OutFrame frame);
  bool hasFrame() const { return frame_.has_value(); }

  // Nothing comes after: what waits is written, then the close frame.
  void finish(boost::beast::websocket::close_code code);
  // The client is gone: what waits is dropped and the socket closed.
  void abandon();

  // Writes until it has finished or was abandoned, or the client takes too little (SendWatch).
  boost::asio::awaitable<void> write();

 private:
  boost::asio::awaitable<bool> send(bool text, boost::asio::const_buffer head, boost::asio::const_buffer rest = {});

  WebSocket& socket_;
  Services& services_;
  std::function<void()> on_room_;
  std::deque<std::string> texts_;
  std::optional<OutFrame> frame_;
  std::optional<boost::beast::websocket::close_code> last_;
  bool abandoned_ = false;
  Signal signal_;
};

}  // namespace blockwalk
