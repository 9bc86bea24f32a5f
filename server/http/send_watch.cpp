// SPDX-License-Identifier: Apache-2.0
#include "server/http/send_watch.h"

#include <spdlog/spdlog.h>

#include <algorithm>

namespace blockwalk {
namespace {

constexpr std::chrono::milliseconds kSendLookTime{250};

}  // namespace

SendBounds sendBounds(const ServerOptions& options) {
  return {.patience = std::chrono::seconds(options.send_time),
          .bytes_per_second = static_cast<double>(options.send_rate)};
}

bool SendRate::isTooSlow(std::uint64_t left, Clock::time_point now) {
  if (left > left_) {
    left_ = left;
    progress_ = now;
  }
  if (now - progress_ > bounds_.patience) return true;
  const std::chrono::duration<double> judged = now - begin_ - bounds_.patience;
  return static_cast<double>(left) < bounds_.bytes_per_second * judged.count();
}

SendWatch::State::State(WireStream& watched, const SendBounds& bounds)
    : stream(&watched), rate(bounds, SendRate::Clock::now()), timer(watched.get_executor()) {}

SendWatch::SendWatch(WireStream& stream, const SendBounds& bounds) : state_(std::make_shared<State>(stream, bounds)) {
  lookLater(state_);
}

SendWatch::~SendWatch() {
  state_->stream = nullptr;
  state_->timer.cancel();
}

void SendWatch::lookLater(std::shared_ptr<State> state) {
  state->timer.expires_after(kSendLookTime);
  asio::steady_timer& timer = state->timer;
  timer.async_wait([state = std::move(state)](boost::system::error_code error) mutable {
    if (error || state->stream == nullptr) return;
    const std::uint64_t waiting = state->stream->unsentBytes();
    if (state->rate.isTooSlow(state->written - std::min(waiting, state->written), SendRate::Clock::now())) {
      spdlog::info("connection closed: the client takes too little of what is sent");
      state->stream->close();
      return;
    }
    WireStream& watched = *state->stream;
    try {
      lookLater(std::move(state));
    } catch (...) {
      watched.close();  // nobody would look any more
      throw;
    }
  });
}

}  // namespace blockwalk
