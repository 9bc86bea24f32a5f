// SPDX-License-Identifier: Apache-2.0
// Everything the socket thread knows. Only that thread touches it, so there is no lock.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "renderer/renderer.h"
#include "server/catalog.h"
#include "server/http/rules.h"
#include "server/http/static_pages.h"
#include "server/options.h"

namespace blockwalk {

// Counted since the start, but for the three of `open`.
struct ServerCounters {
  std::uint64_t requests = 0;
  std::uint64_t refused_requests = 0;  // answered with 4xx
  std::uint64_t failed_requests = 0;   // answered with 5xx
  std::uint64_t frames = 0;            // rendered to the end
  std::uint64_t cancelled_frames = 0;
  std::uint64_t sent_bytes = 0;
  std::uint64_t sessions = 0;
  std::uint64_t dropped_views = 0;  // that no frame showed
  double render_seconds = 0;
  double encode_seconds = 0;
  std::int64_t open_connections = 0;
  std::int64_t open_sessions = 0;
  std::int64_t image_jobs = 0;
};

struct ServerState {
  ServerOptions options;
  HttpRules rules;
  Volumes volumes;
  StaticPages pages;
  std::optional<DeviceInfo> device;  // absent until the render thread has one
  ServerCounters counters;
  std::int64_t pending_pixels =
      0;  // of frames being rendered or encoded, and what encoded ones hold until they are sent
  bool draining = false;

  std::int64_t maxPixels() const { return options.max_megapixels * 1000000; }
};

// Prometheus text.
std::string metricsText(const ServerState& state);

}  // namespace blockwalk
