// SPDX-License-Identifier: Apache-2.0
#include "server/render/frame_maker.h"

#include <chrono>

#include "protocol/image_codec.h"
#include "server/base/elapsed.h"
#include "server/render/await_result.h"

namespace blockwalk {
namespace {

// Of a pixel alone its row is drawn into.
std::int64_t framePixels(const FrameOrder& order) {
  ViewChoices drawn = order.view;
  if (order.pixel) drawn.height = 1;
  return FrameMaker::pixelCount(drawn);
}

PixelRoom::Use useOf(const Account& account) {
  return account.group == RenderThread::kRequests ? PixelRoom::Use::request : PixelRoom::Use::stream;
}

// Raw is the frame itself; else the frame goes once it is encoded, so that a picture is there once.
Bytes imageBytes(std::shared_ptr<const Frame> frame, ImageFormat format, int quality) {
  if (format != ImageFormat::raw) return ownBytes(encodeImage(*frame, format, quality));
  const auto bytes = rawBytes(*frame);
  return {.owner = std::move(frame), .view = bytes};
}

Encoded encodeTimed(const std::function<Bytes()>& encode) noexcept {
  Encoded result;
  const auto begin = std::chrono::steady_clock::now();
  try {
    result.bytes = encode();
  } catch (...) {
    result.error = std::current_exception();
  }
  result.ms = msSince(begin);
  return result;
}

}  // namespace

// In words of a colour's size; a position has three.
std::int64_t FrameMaker::pixelCount(const ViewChoices& view) {
  const std::int64_t words = view.output == Output::position ? 3 : 1;
  return words * view.width * view.height;
}

bool FrameMaker::hasRoom(const Account& account, const ViewChoices& view) const {
  return room_.hasRoom(useOf(account), account.peer, pixelCount(view));
}

bool FrameMaker::hasRoom(const Account& account, const FrameOrder& order) const {
  return room_.hasRoom(useOf(account), account.peer, framePixels(order));
}

std::shared_ptr<PixelRoom::Lease> FrameMaker::takeRoom(const Account& account, std::int64_t pixels) {
  const PixelRoom::Use use = useOf(account);
  if (!room_.hasRoom(use, account.peer, pixels)) return nullptr;
  return std::make_shared<PixelRoom::Lease>(room_, use, account.peer, pixels);
}

void FrameMaker::cancel(std::atomic<bool>& flag) {
  flag = true;
  renderer_.wake();
}

boost::asio::awaitable<DrawnFrame> FrameMaker::draw(ImageOrder order) {
  const PixelRoom::Use use = useOf(order.account);
  DrawnFrame drawn{.account = order.account,
                   .format = order.format,
                   .quality = order.quality,
                   // Whose client has left since is not encoded; a stream's frame that is late is still its newest.
                   .given_up = use == PixelRoom::Use::request ? order.frame.cancel : nullptr,
                   .frame = nullptr,
                   .room = order.room};
  if (drawn.room == nullptr) {
    drawn.room = std::make_shared<PixelRoom::Lease>(room_, use, order.account.peer, framePixels(order.frame));
  }
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
  counters_.pages += rendered.frame.stats.pages_read;
  counters_.pages_foreseen += rendered.frame.stats.foreseen_pages;
  counters_.render_time.add(rendered.took_ms / 1000);
  counters_.wait_time.add(rendered.waited_ms / 1000);
  drawn.frame = std::make_shared<const Frame>(std::move(rendered.frame));
  co_return drawn;
}

boost::asio::awaitable<void> FrameMaker::bringAhead(ImageOrder order) {
  const auto bring = [&](Answer<RenderResult> done) {
    renderer_.submit(order.account, {.volume = order.volume, .frame = order.frame, .done = std::move(done)});
  };
  const RenderResult brought = co_await awaitResult<RenderResult>(mailbox_, bring);
  if (brought.error) std::rethrow_exception(brought.error);
  counters_.pages_ahead += brought.frame.stats.pages_read;
}

boost::asio::awaitable<Encoded> FrameMaker::encode(Account account, bool is_long,
                                                   std::shared_ptr<const std::atomic<bool>> given_up,
                                                   std::function<Bytes()> encode) {
  EncodeQueue::Place* place = nullptr;
  const auto begin = [&](Answer<Encoded> done) {
    auto work = [encode = std::move(encode), given_up = std::move(given_up),
                 done = std::move(done)](std::exception_ptr error) {
      if (given_up != nullptr && *given_up) {
        done({.cancelled = true});
      } else if (error) {
        done({.error = std::move(error)});
      } else {
        done(encodeTimed(encode));
      }
    };
    place = &encodes_.add(account, is_long, std::move(work));
  };
  Encoded encoded = co_await awaitResult<Encoded>(mailbox_, begin);
  if (place != nullptr) encodes_.finish(*place, encoded.ms);
  if (encoded.error) std::rethrow_exception(encoded.error);
  co_return encoded;
}

boost::asio::awaitable<MadeFrame> FrameMaker::encode(DrawnFrame drawn) {
  EncodeFrame as_image = [format = drawn.format, quality = drawn.quality](std::shared_ptr<const Frame> frame) {
    return imageBytes(std::move(frame), format, quality);
  };
  return encode(std::move(drawn), std::move(as_image));
}

boost::asio::awaitable<MadeFrame> FrameMaker::encode(DrawnFrame drawn, EncodeFrame encode_frame) {
  MadeFrame made;
  made.cancelled = drawn.frame == nullptr;
  if (made.cancelled) co_return made;
  made.width = drawn.frame->width;
  made.height = drawn.frame->height;
  made.stats = drawn.frame->stats;
  const bool is_long = EncodeQueue::takesLong(drawn.format, std::int64_t{made.width} * made.height);
  std::function<Bytes()> work = [frame = std::move(drawn.frame), encode_frame = std::move(encode_frame)]() mutable {
    return encode_frame(std::move(frame));
  };
  Encoded encoded = co_await encode(drawn.account, is_long, drawn.given_up, std::move(work));
  made.cancelled = encoded.cancelled;
  if (made.cancelled) {
    ++counters_.cancelled;
    co_return made;
  }
  counters_.encode_time.add(encoded.ms / 1000);
  made.encode_ms = encoded.ms;
  made.image = std::move(encoded.bytes);
  drawn.room->setBytes(made.image.size());
  made.room = std::move(drawn.room);
  co_return made;
}

boost::asio::awaitable<MadeFrame> FrameMaker::make(ImageOrder order) {
  DrawnFrame drawn = co_await draw(std::move(order));
  co_return co_await encode(std::move(drawn));
}

}  // namespace blockwalk
