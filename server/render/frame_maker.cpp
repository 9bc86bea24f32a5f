// SPDX-License-Identifier: Apache-2.0
#include "server/render/frame_maker.h"

#include <chrono>

#include "protocol/image_codec.h"
#include "server/render/await_result.h"

namespace blockwalk {
namespace {

// In words of a colour's size; a position has three.
std::int64_t pixelCount(const ViewChoices& view) {
  const std::int64_t words = view.output == Output::position ? 3 : 1;
  return words * view.width * view.height;
}

// Gives the pixels back however the coroutine ends. Once encoded, a frame counts as the pixels that its bytes would be.
class PixelLease {
 public:
  PixelLease(ServerState& state, std::int64_t pixels) : state_(state), pixels_(pixels) {
    state_.pending_pixels += pixels_;
  }
  ~PixelLease() { state_.pending_pixels -= pixels_; }
  void setBytes(std::size_t bytes) {
    const auto pixels = static_cast<std::int64_t>(bytes / sizeof(std::uint32_t));
    state_.pending_pixels += pixels - pixels_;
    pixels_ = pixels;
  }
  PixelLease(const PixelLease&) = delete;
  PixelLease& operator=(const PixelLease&) = delete;

 private:
  ServerState& state_;
  std::int64_t pixels_;
};

struct EncodeResult {
  std::vector<std::byte> bytes;
  double ms = 0;
  std::exception_ptr error;
};

EncodeResult encodeTimed(const Frame& frame, ImageFormat format, int quality) {
  EncodeResult result;
  const auto begin = std::chrono::steady_clock::now();
  try {
    result.bytes = encodeImage(frame, format, quality);
  } catch (...) {
    result.error = std::current_exception();
  }
  result.ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace

bool FrameMaker::hasRoom(const ViewChoices& view) const {
  // One that is larger than all the room goes alone.
  return state_.pending_pixels == 0 || state_.pending_pixels + pixelCount(view) <= state_.maxPixels();
}

boost::asio::awaitable<MadeFrame> FrameMaker::make(ImageOrder order) {
  const auto room = std::make_shared<PixelLease>(state_, pixelCount(order.frame.view));
  const auto render = [&](std::function<void(RenderResult)> done) {
    renderer_.submit(order.client, {.volume = order.volume, .frame = order.frame, .done = std::move(done)});
  };
  RenderResult rendered = co_await awaitResult<RenderResult>(render);
  if (rendered.error) std::rethrow_exception(rendered.error);
  MadeFrame made{.cancelled = rendered.frame.cancelled,
                 .width = rendered.frame.width,
                 .height = rendered.frame.height,
                 .stats = rendered.frame.stats,
                 .encode_ms = 0,
                 .bytes = {},
                 .room = {}};
  state_.counters.render_seconds += rendered.took_ms / 1000;
  if (made.cancelled) {
    ++state_.counters.cancelled_frames;
    co_return made;
  }
  ++state_.counters.frames;
  const auto frame = std::make_shared<const Frame>(std::move(rendered.frame));
  const auto encode = [&](std::function<void(EncodeResult)> done) {
    asio::post(encoders_, [frame, format = order.format, quality = order.quality, done = std::move(done)] {
      done(encodeTimed(*frame, format, quality));
    });
  };
  EncodeResult encoded = co_await awaitResult<EncodeResult>(encode);
  if (encoded.error) std::rethrow_exception(encoded.error);
  state_.counters.encode_seconds += encoded.ms / 1000;
  made.encode_ms = encoded.ms;
  made.bytes = std::move(encoded.bytes);
  room->setBytes(made.bytes.size());
  made.room = room;
  co_return made;
}

}  // namespace blockwalk
