// SPDX-License-Identifier: Apache-2.0
// Frames for the socket thread: rendered on the render thread, encoded in the pool, counted here.
#pragma once

#include <atomic>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/thread_pool.hpp>
#include <cstdint>
#include <functional>
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
  std::shared_ptr<PixelRoom::Lease> room{};  // that it is drawn in; null: it takes its own
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

// What an encoder made of something.
struct Encoded {
  Bytes bytes{};
  double ms = 0;
  bool cancelled = false;  // then there is nothing else
  std::exception_ptr error{};
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

// Makes bytes of a frame, on a thread of the pool; what it throws comes back.
using EncodeFrame = std::function<Bytes(std::shared_ptr<const Frame>)>;

class FrameMaker {
 public:
  // Pictures have place in `room`, and are counted in `counters`. `encoders` has `encode_threads`.
  FrameMaker(PixelRoom& room, FrameCounters& counters, Mailbox& mailbox, RenderThread& renderer,
             boost::asio::thread_pool& encoders, std::size_t encode_threads)
      : room_(room), counters_(counters), mailbox_(mailbox), renderer_(renderer), encodes_(encoders, encode_threads) {}

  // May a frame of this size be ordered now?
  bool hasRoom(const Account& account, const ViewChoices& view) const;
  bool hasRoom(const Account& account, const FrameOrder& order) const;
  // Room for what is held at a time of several frames of one order, words of 4 bytes: they are drawn in it and take
  // none of their own. Null: there is none now.
  std::shared_ptr<PixelRoom::Lease> takeRoom(const Account& account, std::int64_t pixels);
  static std::int64_t pixelCount(const ViewChoices& view);
  // Throw what the renderer or the encoder threw. Pass arguments that have a name: GCC 12 destroys a braced temporary
  // inside a co_await expression twice, which ends in a crash now and then.
  boost::asio::awaitable<DrawnFrame> draw(ImageOrder order);
  boost::asio::awaitable<MadeFrame> encode(DrawnFrame drawn);
  // Draws nothing (FrameOrder::ahead).
  boost::asio::awaitable<void> bringAhead(ImageOrder order);
  // In another way than in the frame's format, which says how long that takes.
  boost::asio::awaitable<MadeFrame> encode(DrawnFrame drawn, EncodeFrame encode_frame);
  // Whatever else is encoded, in turns with frames: `encode` on one of the encoders' threads, unless `given_up` is set
  // by then. Throws what it threw.
  boost::asio::awaitable<Encoded> encode(Account account, bool is_long,
                                         std::shared_ptr<const std::atomic<bool>> given_up,
                                         std::function<Bytes()> encode);
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
