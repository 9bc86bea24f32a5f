// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "server/base/histogram.h"

namespace blockwalk {

// Counted since the start.
struct FrameCounters {
  std::uint64_t drawn = 0;  // to the end
  std::uint64_t cancelled = 0;
  // Voxels that come and go, by pages: brought in for frames, and for what might come; and of these, those that came.
  std::uint64_t pages = 0;
  std::uint64_t pages_ahead = 0;
  std::uint64_t pages_foreseen = 0;
  // Of each frame that was drawn.
  TimeHistogram render_time;
  TimeHistogram wait_time;  // for its first turn
  TimeHistogram encode_time;
};

}  // namespace blockwalk
