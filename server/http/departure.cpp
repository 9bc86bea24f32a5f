// SPDX-License-Identifier: Apache-2.0
#include "server/http/departure.h"

#include <string_view>
#include <utility>

namespace blockwalk {
namespace {

constexpr std::chrono::milliseconds kDepartureLookTime{50};
constexpr std::string_view kInterim = "HTTP/1.1 102 Processing\r\n\r\n";

}  // namespace

DepartureWatch::DepartureWatch(WireStream& stream, int http_version, std::function<void()> on_gone)
    : state_(std::make_shared<State>(State{.stream = &stream,
                                           .on_gone = std::move(on_gone),
                                           .timer = asio::steady_timer(stream.get_executor()),
                                           .takes_interim = http_version >= 11})) {
  lookLater(state_);
}

DepartureWatch::~DepartureWatch() {
  state_->stream = nullptr;
  state_->timer.cancel();
}

bool DepartureWatch::isGone(State& state) {
  const WireStream::Peer peer = state.stream->peerState();
  if (peer != WireStream::Peer::ended_sending) return peer == WireStream::Peer::gone;
  if (state.stream->isTls() || !state.takes_interim) return true;
  return !std::exchange(state.has_half_closed, true) && !state.stream->sendNow(kInterim);
}

void DepartureWatch::lookLater(std::shared_ptr<State> state) {
  state->timer.expires_after(kDepartureLookTime);
  asio::steady_timer& timer = state->timer;
  timer.async_wait([state = std::move(state)](boost::system::error_code error) mutable {
    if (error || state->stream == nullptr) return;
    if (isGone(*state)) return state->on_gone();
    lookLater(std::move(state));
  });
}

}  // namespace blockwalk
