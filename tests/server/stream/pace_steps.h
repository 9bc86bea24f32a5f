// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "server/stream/pace.h"

namespace blockwalk {

inline constexpr Clock::time_point kStart{std::chrono::hours(1)};

// A frame that is sent as soon as it is drawn.
inline void sendDrawn(StreamPace& pace, const PaceStep& step, double cost_ms, std::size_t bytes,
                      Clock::time_point now) {
  pace.frameDrawn(step);
  pace.frameSent(step, {.draw_ms = cost_ms, .encode_ms = 0}, bytes, now);
}

}  // namespace blockwalk
