// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "server/base/histogram.h"

namespace blockwalk {

// Counted since the start.
struct FrameCounters {
  std::uint64_t drawn = 0;  // to the end
  std::uint64_t cancelled = 0;
  // Of each frame that was drawn.
  TimeHistogram render_time;
  TimeHistogram wait_time;  // for its first turn
  TimeHistogram encode_time;
};

}  // namespace blockwalk
