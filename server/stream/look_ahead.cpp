// SPDX-License-Identifier: Apache-2.0
#include "server/stream/look_ahead.h"

#include <spdlog/spdlog.h>

#include <utility>

#include "server/base/reason.h"
#include "view/motion.h"

namespace blockwalk {
namespace {

// That it looks ahead, in frames: the next one, and at 30 a second up to a quarter of a second.
constexpr int kFramesAhead[] = {1, 2, 4, 8};

}  // namespace

void LookAhead::stop() {
  is_due_ = false;
  if (cancel_) frames_.cancel(*cancel_);
}

void LookAhead::goOn(const ImageOrder& drawn, bool paged) {
  before_ = last_ ? std::optional(last_->frame.view) : std::nullopt;
  last_ = drawn;
  is_due_ = paged && before_.has_value();
  if (is_due_) signal_.notify();
}

void LookAhead::end() {
  has_ended_ = true;
  stop();
  signal_.notify();
}

boost::asio::awaitable<void> LookAhead::run() {
  while (!has_ended_) {
    if (!std::exchange(is_due_, false)) {
      co_await signal_.wait();
      continue;
    }
    const auto cancel = std::make_shared<std::atomic<bool>>(false);
    cancel_ = cancel;
    const ImageOrder now = *last_;
    const ResolvedView before = *before_;
    for (const int times : kFramesAhead) {
      const std::optional<ResolvedView> next = movedOn(before, now.frame.view, times);
      if (!next || *cancel) break;
      ImageOrder order = now;
      order.frame = {.view = *next, .count = false, .ahead = true, .cancel = cancel};
      try {
        co_await frames_.bringAhead(order);
      } catch (const std::exception& error) {
        // Whoever comes there is told what there is to tell.
        spdlog::debug("nothing is brought in ahead: {}", error.what());
        break;
      }
    }
    cancel_.reset();
  }
}

}  // namespace blockwalk
