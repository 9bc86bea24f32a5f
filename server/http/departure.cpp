// SPDX-License-Identifier: Apache-2.0
#include "server/http/departure.h"

#include <utility>

namespace blockwalk {
namespace {

constexpr std::chrono::milliseconds kDepartureLookTime{50};

}  // namespace

DepartureWatch::DepartureWatch(WireStream& stream, std::function<void()> on_gone)
    : state_(std::make_shared<State>(State{
          .stream = &stream, .on_gone = std::move(on_gone), .timer = asio::steady_timer(stream.get_executor())})) {
  lookLater(state_);
}

DepartureWatch::~DepartureWatch() {
  state_->stream = nullptr;
  state_->timer.cancel();
}

void DepartureWatch::lookLater(std::shared_ptr<State> state) {
  state->timer.expires_after(kDepartureLookTime);
  asio::steady_timer& timer = state->timer;
  timer.async_wait([state = std::move(state)](boost::system::error_code error) mutable {
    if (error || state->stream == nullptr) return;
    const WireStream::Peer peer = state->stream->peerState();
    if (std::exchange(state->is_first, false)) state->has_half_closed = peer == WireStream::Peer::ended_sending;
    const bool is_gone =
        peer == WireStream::Peer::gone || (peer == WireStream::Peer::ended_sending && !state->has_half_closed);
    if (is_gone) return state->on_gone();
    lookLater(std::move(state));
  });
}

}  // namespace blockwalk
