// SPDX-License-Identifier: Apache-2.0
// Frames for the socket thread: rendered on the render thread, encoded in the pool, counted here.
#pragma once

#include <atomic>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/thread_pool.hpp>
#include <cstdint>
#include <memory>

#include "protocol/view_fields.h"
#include "server/base/bytes.h"
#include "server/render/encode_queue.h"
#include "server/render/frame_counters.h"
#include "server/render/pixel_room.h"
#include "server/render/render_thread.h"

namespace blockwalk {

struct ImageOrder {
  Account account{};  // that the device time is charged to
  VolumeId volume = 0;
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
  Bytes image;
  std::shared_ptr<void> room;  // held while the bytes are: see PixelRoom
};

// On its way from the device to the encoder.
struct DrawnFrame {
  Account account{};
  ImageFormat format = ImageFormat::png;
  int quality = 85;
  std::shared_ptr<const std::atomic<bool>> given_up;  // where set and true, it is not encoded
  std::shared_ptr<const Frame> frame;                 // null: it was cancelled
  std::shared_ptr<PixelRoom::Lease> room;
};

class FrameMaker {
 public:
  // Pictures have place in `room`, and are counted in `counters`. `encoders` has `encode_threads`.
  FrameMaker(PixelRoom& room, FrameCounters& counters, Mailbox& mailbox, RenderThread& renderer,
             boost::asio::thread_pool& encoders, std::size_t encode_threads)
      : room_(room), counters_(counters), mailbox_(mailbox), renderer_(renderer), encodes_(encoders, encode_threads) {}

  // May a frame of this size be ordered now?
  bool hasRoom(const Account& account, const ViewChoices& view) const;
  // Throw what the renderer or the encoder threw. Pass arguments that have a name: GCC 12 destroys a braced temporary
  // inside a co_await expression twice, which ends in a crash now and then.
  boost::asio::awaitable<DrawnFrame> draw(ImageOrder order);
  boost::asio::awaitable<MadeFrame> encode(DrawnFrame drawn);
  // One after the other.
  boost::asio::awaitable<MadeFrame> make(ImageOrder order);
  // The flag of an order is set, and the order ends at its next turn, which comes at once.
  void cancel(std::atomic<bool>& flag);
  // What is kept for this client's refinements is let go.
  void forget(std::uint64_t client) { renderer_.forget(client); }
  std::uint64_t newClient() { return ++last_client_; }
  // After the encoders have ended: what they have not encoded is dropped, unanswered.
  void end() noexcept { encodes_.end(); }

 private:
  PixelRoom& room_;
  FrameCounters& counters_;
  Mailbox& mailbox_;
  RenderThread& renderer_;
  EncodeQueue encodes_;
  std::uint64_t last_client_ = 0;
};

}  // namespace blockwalk
