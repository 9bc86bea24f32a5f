// SPDX-License-Identifier: Apache-2.0
#include "server/animation_reply.h"

#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <chrono>
#include <nlohmann/json.hpp>
#include <utility>

#include "protocol/animated_webp.h"
#include "protocol/json_text.h"
#include "protocol/stored_zip.h"
#include "server/http/problem.h"
#include "server/render/await_result.h"

namespace blockwalk {
namespace {

using CancelFlag = std::shared_ptr<std::atomic<bool>>;
constexpr std::chrono::milliseconds kRoomLookTime{20};
constexpr const char* kEnding = "the server is ending";

// As of a picture that is asked for by itself.
ImageOrder orderOf(const Account& account, const AnimationJob& job, int frame, CancelFlag cancel) {
  return {
      .account = account,
      .volume = job.volume->number,
      .format = job.format == AnimationFormat::zip ? ImageFormat::png : ImageFormat::webp,
      .quality = job.quality,
      .frame = {
          .view = resolveView(job.film->view(frame), *job.volume->info), .count = false, .cancel = std::move(cancel)}};
}

HttpReply headOf(const AnimationJob& job) {
  HttpReply reply{.status = 200, .type = std::string(animationMimeType(job.format)), .fields = {}, .body = {}};
  reply.fields.emplace_back("Cache-Control", "no-store");
  // An id needs no escapes.
  const char* ending = job.format == AnimationFormat::zip ? "zip" : "webp";
  reply.fields.emplace_back("Content-Disposition",
                            fmt::format("attachment; filename=\"{}.{}\"", job.volume->id, ending));
  reply.fields.emplace_back("X-Blockwalk-Animation",
                            writeJson({{"frames", job.film->frames()}, {"fps", job.film->fps()}}));
  return reply;
}

class ZipOfFrames final : public ReplyBody {
 public:
  ZipOfFrames(Services& services, const Account& account, AnimationJob job, std::shared_ptr<void> place)
      : services_(services), account_(account), job_(std::move(job)), place_(std::move(place)) {}

  const char* name() const override { return "an animation"; }

  // The first frame; throws what FrameMaker throws.
  asio::awaitable<void> begin(CancelFlag cancel) { first_ = co_await draw(std::move(cancel)); }

  asio::awaitable<BodyPiece> next(CancelFlag cancel) override {
    BodyPiece piece;
    try {
      if (next_ > 0 && first_.bytes) co_return std::exchange(first_, {});
      if (next_ < job_.film->frames()) {
        piece = co_await draw(std::move(cancel));
      } else if (next_ == job_.film->frames()) {
        ++next_;
        piece.head = zip_.end();
      }
    } catch (...) {
      piece.error = std::current_exception();
    }
    co_return piece;
  }

 private:
  asio::awaitable<BodyPiece> draw(CancelFlag cancel) {
    const ImageOrder order = orderOf(account_, job_, next_, cancel);
    asio::steady_timer timer(co_await asio::this_coro::executor);
    // Who comes first finds room or is told so; who is at work waits for it.
    while (next_ > 0 && !services_.frames.hasRoom(account_, order.frame) && !*cancel && !services_.state.draining) {
      timer.expires_after(kRoomLookTime);
      co_await timer.async_wait(asio::use_awaitable);
    }
    MadeFrame made;
    made.cancelled = *cancel || services_.state.draining;
    if (!made.cancelled) made = co_await services_.frames.make(order);
    if (made.cancelled) throw ProblemError({.status = 503, .detail = kEnding, .field = {}});
    BodyPiece piece;
    piece.head = zip_.begin(fmt::format("frame{:04}.png", next_++), made.image.view);
    piece.bytes = std::move(made.image);
    piece.room = std::move(made.room);
    co_return piece;
  }

  Services& services_;
  const Account account_;
  const AnimationJob job_;
  const std::shared_ptr<void> place_;
  StoredZip zip_;
  BodyPiece first_;
  int next_ = 0;
};

// The encoder keeps two pictures beside the frame that it gets.
asio::awaitable<HttpReply> makeWebp(Services& services, Account account, AnimationJob job, CancelFlag cancel) {
  const View view = job.film->view(0);
  const std::int64_t pixels = std::int64_t{view.width} * view.height;
  const auto room =
      std::make_shared<PixelRoom::Lease>(services.state.room, PixelRoom::Use::request, account.peer, 2 * pixels);
  const auto webp = std::make_shared<AnimatedWebp>(view.width, view.height, job.film->fps(), job.quality);
  MadeFrame made;
  for (int frame = 0; frame < job.film->frames(); ++frame) {
    const ImageOrder order = orderOf(account, job, frame, cancel);
    made = {};
    DrawnFrame drawn = co_await services.frames.draw(order);
    const bool is_last = frame + 1 == job.film->frames();
    EncodeFrame add = [webp, is_last](std::shared_ptr<const Frame> one) {
      webp->add(one->pixels);
      return is_last ? ownBytes(webp->finish()) : Bytes{};
    };
    made = co_await services.frames.encode(std::move(drawn), std::move(add));
    if (made.cancelled || services.state.draining) {
      co_return problemReply({.status = 503, .detail = kEnding, .field = {}});
    }
  }
  HttpReply reply = headOf(job);
  reply.body = made.image;
  reply.room = made.room;
  co_return reply;
}

}  // namespace

asio::awaitable<AnimationReply> replyWithAnimation(Services& services, Account account, AnimationJob job,
                                                   CancelFlag cancel) {
  AnimationReply made;
  auto place = services.animations.lease(account.peer);
  ViewChoices drawn = job.film->view(0);
  if (job.format == AnimationFormat::webp) drawn.output = Output::position;  // of three words a pixel
  if (place == nullptr || !services.frames.hasRoom(account, drawn)) {
    const char* what = place == nullptr ? "as many animations are made as may" : "as many images wait as may";
    made.reply = failureReply({.status = 429, .detail = what, .field = {}});
    co_return made;
  }
  if (job.format == AnimationFormat::webp) {
    made.reply = co_await makeWebp(services, account, std::move(job), std::move(cancel));
    co_return made;
  }
  made.reply = headOf(job);
  made.reply.is_chunked = true;
  auto zip = std::make_unique<ZipOfFrames>(services, account, std::move(job), std::move(place));
  co_await zip->begin(std::move(cancel));
  made.body = std::move(zip);
  co_return made;
}

}  // namespace blockwalk
