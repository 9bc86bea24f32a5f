// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "server/server_state.h"

namespace blockwalk {

std::string metricsText(const ServerState& state) {
  std::string text;
  const auto add = [&](std::string_view name, std::string_view type, std::string_view help, auto value) {
    text +=
        fmt::format("# HELP blockwalk_{0} {2}\n# TYPE blockwalk_{0} {1}\nblockwalk_{0} {3}\n", name, type, help, value);
  };
  const ServerCounters& counters = state.counters;
  add("requests_total", "counter", "HTTP requests", counters.requests);
  add("refused_requests_total", "counter", "requests answered with 4xx", counters.refused_requests);
  add("failed_requests_total", "counter", "requests answered with 5xx", counters.failed_requests);
  add("frames_total", "counter", "frames rendered", counters.frames);
  add("cancelled_frames_total", "counter", "frames given up for a newer view", counters.cancelled_frames);
  add("dropped_views_total", "counter", "views that no frame showed", counters.dropped_views);
  add("sent_bytes_total", "counter", "bytes of replies and frames", counters.sent_bytes);
  add("sessions_total", "counter", "streams opened", counters.sessions);
  add("render_seconds_total", "counter", "time in the renderer", counters.render_seconds);
  add("encode_seconds_total", "counter", "time in the encoders", counters.encode_seconds);
  add("open_connections", "gauge", "connections open now", counters.open_connections);
  add("open_sessions", "gauge", "streams open now", counters.open_sessions);
  add("image_jobs", "gauge", "images of HTTP requests under way", counters.image_jobs);
  if (state.device) {
    add("device_memory_used_bytes", "gauge", "device memory in use", state.device->memory_used_bytes);
    add("device_memory_budget_bytes", "gauge", "device memory to use", state.device->memory_budget_bytes);
  }
  return text;
}

}  // namespace blockwalk
