// SPDX-License-Identifier: Apache-2.0
#include "server/image_reply.h"

#include <algorithm>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "protocol/image_codec.h"
#include "protocol/json_text.h"
#include "protocol/render_json.h"
#include "server/http/problem.h"
#include "server/render/await_result.h"

namespace blockwalk {
namespace {

using CancelFlag = std::shared_ptr<std::atomic<bool>>;

constexpr int kCoarseSide = 4;  // pixels that one of the first picture stands for, a side

// One picture of several that come nearer to the one asked for.
struct ImageStep {
  FrameOrder order;
  int samples = 1;
  bool is_coarse = false;
};

// What was drawn last.
struct BestPicture {
  DrawnFrame drawn;
  int samples = 1;
  bool is_coarse = false;
  bool is_last = false;
};

// As large as was asked for, of a picture of fewer pixels.
std::shared_ptr<const Frame> enlarged(const Frame& frame, int width, int height) {
  auto large = std::make_shared<Frame>();
  large->width = width;
  large->height = height;
  large->output = frame.output;
  large->stats = frame.stats;
  large->values_min = frame.values_min;
  large->values_max = frame.values_max;
  const auto parts =
      frame.values.size() / (static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height));
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (parts > 0) large->values.reserve(pixels * parts);
  if (parts == 0) large->pixels.reserve(pixels);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto from = static_cast<std::size_t>(y * static_cast<std::int64_t>(frame.height) / height * frame.width +
                                                 x * static_cast<std::int64_t>(frame.width) / width);
      if (parts == 0) large->pixels.push_back(frame.pixels[from]);
      for (std::size_t part = 0; part < parts; ++part) large->values.push_back(frame.values[from * parts + part]);
    }
  }
  return large;
}

std::vector<ImageStep> stepsOf(const ImageJob& job, std::uint64_t owner) {
  std::vector<ImageStep> steps;
  View small = spellOut(job.view);
  small.width = std::max(1, (small.width + kCoarseSide - 1) / kCoarseSide);
  small.height = std::max(1, (small.height + kCoarseSide - 1) / kCoarseSide);
  small.samples = 1;
  ImageStep coarse{.order = {.view = resolveView(small, *job.volume->info), .as_it_is = true}, .is_coarse = true};
  // Of what a pixel of the coarse picture sees, the proportions stay those of the whole.
  coarse.order.view.camera = job.view.camera;
  steps.push_back(std::move(coarse));
  const bool keeps_sums = job.view.samples > 1 && std::int64_t{job.view.width} * job.view.height <= kMaxRefinedPixels;
  for (int begin = 0, end = keeps_sums ? 1 : job.view.samples; begin < job.view.samples;) {
    ImageStep step{.order = {.view = job.view}, .samples = end};
    if (keeps_sums) step.order.step = SampleStep{.owner = owner, .begin = begin, .end = end};
    steps.push_back(std::move(step));
    begin = end;
    end = std::min(2 * end, job.view.samples);
  }
  return steps;
}

// Words of 4 bytes: the picture before is there while one is drawn, or is enlarged.
std::int64_t mostHeld(const std::vector<ImageStep>& steps) {
  std::int64_t most = 0;
  for (std::size_t i = 1; i < steps.size(); ++i) {
    most =
        std::max(most, FrameMaker::pixelCount(steps[i - 1].order.view) + FrameMaker::pixelCount(steps[i].order.view));
  }
  return most;
}

ImageOrder orderOf(const ImageJob& job, const Account& account, FrameOrder frame) {
  return {.account = account,
          .volume = job.volume->number,
          .format = job.format,
          .quality = job.quality,
          .frame = std::move(frame)};
}

// The time that is left; what it ends is the step under way, once there is a picture.
class Deadline {
 public:
  Deadline(boost::asio::any_io_executor executor, std::chrono::milliseconds time, FrameMaker& frames, CancelFlag cancel)
      : timer_(executor), state_(std::make_shared<State>()) {
    timer_.expires_after(time);
    timer_.async_wait([state = state_, &frames, cancel = std::move(cancel)](boost::system::error_code error) {
      if (error || state->is_over) return;
      state->is_up = true;
      if (state->has_picture) frames.cancel(*cancel);
    });
  }
  ~Deadline() { state_->is_over = true; }
  Deadline(const Deadline&) = delete;
  Deadline& operator=(const Deadline&) = delete;

  bool isUp() const { return state_->is_up; }
  void hasPicture() { state_->has_picture = true; }

 private:
  struct State {
    bool is_up = false;
    bool has_picture = false;
    bool is_over = false;
  };
  boost::asio::steady_timer timer_;
  std::shared_ptr<State> state_;
};

// Draws in `room`, of which is left what the picture takes.
boost::asio::awaitable<BestPicture> drawUntil(Services& services, const Account& account, const ImageJob& job,
                                              std::vector<ImageStep> steps, std::shared_ptr<PixelRoom::Lease> room,
                                              CancelFlag cancel) {
  const auto executor = co_await boost::asio::this_coro::executor;
  Deadline deadline(executor, *job.deadline, services.frames, cancel);
  BestPicture best;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (deadline.isUp() && best.drawn.frame != nullptr) break;
    steps[i].order.cancel = cancel;
    ImageOrder order = orderOf(job, account, steps[i].order);
    order.room = room;
    DrawnFrame drawn = co_await services.frames.draw(order);
    if (drawn.frame == nullptr) break;
    best.drawn = std::move(drawn);
    best.samples = steps[i].samples;
    best.is_coarse = steps[i].is_coarse;
    best.is_last = i + 1 == steps.size();
    deadline.hasPicture();
  }
  if (steps.back().order.step) services.frames.forget(account.client);
  if (best.drawn.frame == nullptr) co_return best;
  best.drawn.given_up = nullptr;  // the time was up, and not the client gone
  if (best.is_coarse) best.drawn.frame = enlarged(*best.drawn.frame, job.view.width, job.view.height);
  room->setBytes(4 * static_cast<std::size_t>(FrameMaker::pixelCount(job.view)));
  co_return best;
}

HttpReply tooManyReply() { return failureReply({.status = 429, .detail = "as many images wait as may", .field = {}}); }

HttpReply replyOf(const ImageJob& job, const MadeFrame& made, const BestPicture* best) {
  HttpReply reply{.status = 200, .type = std::string(imageMimeType(job.format)), .fields = {}, .body = made.image};
  reply.room = made.room;
  // What was short of memory, or of time, may be whole another time.
  const bool is_whole = made.stats.isComplete() && (best == nullptr || best->is_last);
  if (is_whole) reply.fields.emplace_back("ETag", job.etag);
  reply.fields.emplace_back("Cache-Control", is_whole ? "no-cache" : "no-store");
  nlohmann::json stats = statsJson(made.stats);
  if (best != nullptr) {
    stats["final"] = best->is_last;
    stats["samples"] = best->samples;
    stats["scale"] = best->is_coarse ? 1.0 / kCoarseSide : 1.0;
  }
  reply.fields.emplace_back("X-Blockwalk-Stats", writeJson(stats));
  if (job.format == ImageFormat::raw) reply.fields.emplace_back("X-Blockwalk-Raw", writeJson(rawJson(job.view)));
  return reply;
}

}  // namespace

boost::asio::awaitable<HttpReply> replyWithImage(Services& services, Account account, ImageJob job, CancelFlag cancel) {
  std::optional<BestPicture> best;
  MadeFrame made;
  if (job.deadline) {
    std::vector<ImageStep> steps = stepsOf(job, account.client);
    const auto room = services.frames.takeRoom(account, mostHeld(steps));
    if (room == nullptr) co_return tooManyReply();
    best = co_await drawUntil(services, account, job, std::move(steps), room, cancel);
    made = co_await services.frames.encode(best->drawn);
  } else {
    if (!services.frames.hasRoom(account, job.view)) co_return tooManyReply();
    const ImageOrder order = orderOf(job, account, {.view = job.view, .cancel = cancel});
    made = co_await services.frames.make(order);
  }
  if (made.cancelled) co_return problemReply({.status = 503, .detail = "the server is ending", .field = {}});
  co_return replyOf(job, made, best ? &*best : nullptr);
}

}  // namespace blockwalk
