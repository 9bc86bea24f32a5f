// SPDX-License-Identifier: Apache-2.0
#include "server/render/frame_maker.h"

#include <chrono>

#include "protocol/image_codec.h"
#include "server/base/elapsed.h"
#include "server/render/await_result.h"

namespace blockwalk {
namespace {

// In words of a colour's size; a position has three.
std::int64_t pixelCount(const ViewChoices& view) {
  const std::int64_t words = view.output == Output::position ? 3 : 1;
  return words * view.width * view.height;
}

PixelRoom::Use useOf(const Account& account) {
  return account.group == RenderThread::kRequests ? PixelRoom::Use::request : PixelRoom::Use::stream;
}

struct EncodeResult {
  Bytes image{};
  double ms = 0;
  bool cancelled = false;
  std::exception_ptr error{};
};

// Raw is the frame itself; else the frame goes once it is encoded, so that a picture is there once.
EncodeResult encodeTimed(std::shared_ptr<const Frame> frame, ImageFormat format, int quality) noexcept {
  EncodeResult result;
  const auto begin = std::chrono::steady_clock::now();
  try {
    if (format == ImageFormat::raw) {
      const auto bytes = rawBytes(*frame);
      result.image = {.owner = std::move(frame), .view = bytes};
    } else {
      result.image = ownBytes(encodeImage(*frame, format, quality));
    }
  } catch (...) {
    result.error = std::current_exception();
  }
  result.ms = msSince(begin);
  return result;
}

}  // namespace

bool FrameMaker::hasRoom(const Account& account, const ViewChoices& view) const {
  return room_.hasRoom(useOf(account), account.peer, pixelCount(view));
}

void FrameMaker::cancel(std::atomic<bool>& flag) {
  flag = true;
  renderer_.wake();
}

boost::asio::awaitable<DrawnFrame> FrameMaker::draw(ImageOrder order) {
  const PixelRoom::Use use = useOf(order.account);
  DrawnFrame drawn{
      .account = order.account,
      .format = order.format,
      .quality = order.quality,
      // Whose client has left since is not encoded; a stream's frame that is late is still its newest.
      .given_up = use == PixelRoom::Use::request ? order.frame.cancel : nullptr,
      .frame = nullptr,
      .room = std::make_shared<PixelRoom::Lease>(room_, use, order.account.peer, pixelCount(order.frame.view))};
  const auto render = [&](Answer<RenderResult> done) {
    renderer_.submit(order.account, {.volume = order.volume, .frame = order.frame, .done = std::move(done)});
  };
  RenderResult rendered = co_await awaitResult<RenderResult>(mailbox_, render);
  if (rendered.error) std::rethrow_exception(rendered.error);
  if (rendered.frame.cancelled) {
    ++counters_.cancelled;
    co_return drawn;
  }
  ++counters_.drawn;
  counters_.render_time.add(rendered.took_ms / 1000);
  counters_.wait_time.add(rendered.waited_ms / 1000);
  drawn.frame = std::make_shared<const Frame>(std::move(rendered.frame));
  co_return drawn;
}

boost::asio::awaitable<MadeFrame> FrameMaker::encode(DrawnFrame drawn) {
  MadeFrame made;
  made.cancelled = drawn.frame == nullptr;
  if (made.cancelled) co_return made;
  made.width = drawn.frame->width;
  made.height = drawn.frame->height;
  made.stats = drawn.frame->stats;
  EncodeQueue::Place* place = nullptr;
  const auto encode = [&](Answer<EncodeResult> done) {
    auto work = [frame = std::move(drawn.frame), format = drawn.format, quality = drawn.quality,
                 given_up = drawn.given_up, done = std::move(done)](std::exception_ptr error) mutable {
      if (given_up != nullptr && *given_up) {
        done({.cancelled = true});
      } else if (error) {
        done({.error = std::move(error)});
      } else {
        done(encodeTimed(std::move(frame), format, quality));
      }
    };
    place = &encodes_.add(drawn.account, drawn.format, std::int64_t{made.width} * made.height, std::move(work));
  };
  EncodeResult encoded = co_await awaitResult<EncodeResult>(mailbox_, encode);
  if (place != nullptr) encodes_.finish(*place, encoded.ms);
  if (encoded.error) std::rethrow_exception(encoded.error);
  made.cancelled = encoded.cancelled;
  if (made.cancelled) {
    ++counters_.cancelled;
    co_return made;
  }
  counters_.encode_time.add(encoded.ms / 1000);
  made.encode_ms = encoded.ms;
  made.image = std::move(encoded.image);
  drawn.room->setBytes(made.image.size());
  made.room = std::move(drawn.room);
  co_return made;
}

boost::asio::awaitable<MadeFrame> FrameMaker::make(ImageOrder order) {
  DrawnFrame drawn = co_await draw(std::move(order));
  co_return co_await encode(std::move(drawn));
}

}  // namespace blockwalk
