// SPDX-License-Identifier: Apache-2.0
#include "server/questions.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>

#include "protocol/json_text.h"
#include "protocol/pick_request.h"
#include "protocol/reasons_json.h"
#include "server/http/problem.h"
#include "server/render/await_result.h"

namespace blockwalk {
namespace {

constexpr int kSmallSide = 256;

HttpReply tooMany(const char* what) {
  return failureReply({.status = 429, .detail = fmt::format("as many {} as may", what), .field = {}});
}

HttpReply answerOf(const nlohmann::json& value) {
  HttpReply reply = textReply(200, "application/json", writeJson(value));
  reply.fields.emplace_back("Cache-Control", "no-store");
  return reply;
}

HttpReply endingReply() { return problemReply({.status = 503, .detail = "the server is ending", .field = {}}); }

using CancelFlag = std::shared_ptr<std::atomic<bool>>;

boost::asio::awaitable<HttpReply> answerJob(Services& services, Account account, ImageJob job, CancelFlag cancel) {
  return replyWithImage(services, account, std::move(job), std::move(cancel));
}

boost::asio::awaitable<HttpReply> answerJob(Services& services, Account account, ExplainJob job, CancelFlag cancel) {
  const ImageOrder order{.account = account,
                         .volume = job.volume->number,
                         .frame = {.view = job.view, .count = false, .cancel = std::move(cancel)}};
  if (!services.frames.hasRoom(account, order.frame)) co_return tooMany("images wait");
  const DrawnFrame drawn = co_await services.frames.draw(order);
  if (drawn.frame == nullptr) co_return endingReply();
  const RenderStats& stats = drawn.frame->stats;
  co_return answerOf({{"empty", stats.drawn_pixels == 0},
                      {"level", stats.level},
                      {"complete", stats.isComplete()},
                      {"reasons", reasonsJson(stats.reasons)}});
}

boost::asio::awaitable<HttpReply> answerJob(Services& services, Account account, PickJob job, CancelFlag cancel) {
  const bool hits = job.view.mode == Mode::first_hit || job.view.mode == Mode::iso;
  const ImageOrder order{.account = account,
                         .volume = job.volume->number,
                         .frame = {.view = job.view,
                                   .count = false,
                                   .probe = hits,  // which voxel it is
                                   .pixel = job.pixel,
                                   .cancel = std::move(cancel)}};
  if (!services.frames.hasRoom(account, order.frame)) co_return tooMany("images wait");
  const DrawnFrame drawn = co_await services.frames.draw(order);
  if (drawn.frame == nullptr) co_return endingReply();
  const std::optional<ShownPoint> shown = drawn.frame->shown;
  if (!shown) co_return answerOf(pickJson({}, {}));
  const auto place = services.regions.lease(account.peer);
  if (place == nullptr) co_return tooMany("regions are sent");
  const VoxelOrder voxel{.served = job.file, .step = job.view.time, .voxel = shown->voxel};
  const VoxelValues read = co_await services.regions.values(voxel);
  if (read.error) std::rethrow_exception(read.error);
  co_return answerOf(pickJson(shown, read.values));
}

boost::asio::awaitable<HttpReply> answerJob(Services& services, Account account, SliceJob job, CancelFlag cancel) {
  const auto place = services.regions.lease(account.peer);
  if (place == nullptr) co_return tooMany("regions are sent");
  const std::string_view type = sliceMimeType(job.order.slice.format);
  const std::string name = fmt::format("{}.{}", job.order.served.id, job.order.slice.format);  // an id needs no escapes
  const bool is_picture = job.order.slice.isPicture();
  const ReadSlice read = co_await services.regions.slice(std::move(job.order), cancel);
  if (read.error) std::rethrow_exception(read.error);
  if (read.slice == nullptr) co_return endingReply();
  const std::string description = read.slice->description();
  const bool is_long = read.slice->encodesLong();
  std::function<Bytes()> encode = [slice = read.slice] { return ownBytes(slice->encode()); };
  const std::shared_ptr<const std::atomic<bool>> given_up = cancel;
  Encoded made = co_await services.frames.encode(account, is_long, given_up, std::move(encode));
  if (made.cancelled) co_return endingReply();
  HttpReply reply{.status = 200, .type = std::string(type), .fields = {}, .body = std::move(made.bytes)};
  reply.room = place;
  reply.fields.emplace_back("ETag", job.etag);
  reply.fields.emplace_back("Cache-Control", "no-cache");
  reply.fields.emplace_back("X-Blockwalk-Slice", description);
  if (!is_picture) {
    reply.fields.emplace_back("Content-Disposition", fmt::format("attachment; filename=\"{}\"", name));
  }
  co_return reply;
}

}  // namespace

View smallPicture(View view) {
  const double scale = std::min(1.0, static_cast<double>(kSmallSide) / std::max(view.width, view.height));
  view.width = std::max(1, static_cast<int>(std::lround(view.width * scale)));
  view.height = std::max(1, static_cast<int>(std::lround(view.height * scale)));
  view.samples = 1;
  view.output = Output::color;
  return view;
}

boost::asio::awaitable<HttpReply> answerQuestion(Services& services, Account account, Question question,
                                                 std::shared_ptr<std::atomic<bool>> cancel) {
  return std::visit([&](auto& job) { return answerJob(services, account, std::move(job), std::move(cancel)); },
                    question);
}

}  // namespace blockwalk
