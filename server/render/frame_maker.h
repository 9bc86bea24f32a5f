// SPDX-License-Identifier: Apache-2.0
// Frames for the socket thread: rendered on the render thread, encoded in the pool, counted here.
#pragma once

#include <atomic>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/thread_pool.hpp>
#include <cstdint>
#include <memory>
#include <optional>

#include "protocol/view_fields.h"
#include "server/http/message.h"
#include "server/render/render_thread.h"
#include "server/server_state.h"

namespace blockwalk {

struct ImageOrder {
  std::uint64_t client = 0;  // that the device time is charged to
  std::size_t volume = 0;
  ImageFormat format = ImageFormat::png;
  int quality = 85;
  FrameOrder frame{};
};

struct MadeFrame {
  bool cancelled = false;
  int width = 0;
  int height = 0;
  RenderStats stats;
  double encode_ms = 0;
  std::vector<std::byte> bytes;
  std::shared_ptr<void> room;  // held while the bytes are: see ServerState::pending_pixels
};

class FrameMaker {
 public:
  FrameMaker(ServerState& state, RenderThread& renderer, boost::asio::thread_pool& encoders)
      : state_(state), renderer_(renderer), encoders_(encoders) {}

  // Would a frame of this size exceed the pixels that may be under way at the same time?
  bool hasRoom(const ViewChoices& view) const;
  // Throws what the renderer or the encoder threw. Pass an order that has a name: GCC 12 destroys a braced temporary
  // inside a co_await expression twice, which ends in a crash now and then.
  boost::asio::awaitable<MadeFrame> make(ImageOrder order);
  std::uint64_t newClient() { return ++last_client_; }

 private:
  ServerState& state_;
  RenderThread& renderer_;
  boost::asio::thread_pool& encoders_;
  std::uint64_t last_client_ = 0;
};

}  // namespace blockwalk
