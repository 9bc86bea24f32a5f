// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "server/state/server_state.h"

namespace blockwalk {
namespace {

class MetricsWriter {
 public:
  void head(std::string_view name, std::string_view type, std::string_view help) {
    text += fmt::format("# HELP blockwalk_{0} {2}\n# TYPE blockwalk_{0} {1}\n", name, type, help);
  }
  template <typename Value>
  void add(std::string_view name, std::string_view type, std::string_view help, Value value) {
    head(name, type, help);
    text += fmt::format("blockwalk_{} {}\n", name, value);
  }
  void add(std::string_view name, std::string_view help, const TimeHistogram& times) {
    head(name, "histogram", help);
    for (std::size_t i = 0; i < TimeHistogram::kBounds_s.size(); ++i) {
      text += fmt::format("blockwalk_{}_bucket{{le=\"{}\"}} {}\n", name, TimeHistogram::kBounds_s[i], times.upTo(i));
    }
    text += fmt::format("blockwalk_{0}_bucket{{le=\"+Inf\"}} {1}\nblockwalk_{0}_sum {2}\nblockwalk_{0}_count {1}\n",
                        name, times.count(), times.sum());
  }

  std::string text;
};

}  // namespace

std::string metricsText(const ServerState& state) {
  MetricsWriter metrics;
  const ServerCounters& counters = state.counters;
  metrics.add("requests_total", "counter", "HTTP requests", counters.requests);
  metrics.add("refused_requests_total", "counter", "requests answered with 4xx", counters.refused_requests);
  metrics.add("failed_requests_total", "counter", "requests answered with 5xx", counters.failed_requests);
  metrics.add("frames_total", "counter", "frames rendered", counters.frames.drawn);
  metrics.add("cancelled_frames_total", "counter", "frames given up for a newer view", counters.frames.cancelled);
  metrics.add("pages_total", "counter", "blocks of voxels read for frames", counters.frames.pages);
  metrics.add("pages_ahead_total", "counter", "blocks of voxels read for views that might come",
              counters.frames.pages_ahead);
  metrics.add("pages_foreseen_total", "counter", "blocks read ahead that a frame has shown since",
              counters.frames.pages_foreseen);
  metrics.add("dropped_views_total", "counter", "views that no frame showed", counters.dropped_views);
  metrics.add("sent_bytes_total", "counter", "bytes of replies and frames", counters.sent_bytes);
  metrics.add("sessions_total", "counter", "streams opened", counters.sessions);
  metrics.add("evicted_connections_total", "counter", "connections closed to make place for others",
              counters.evicted_connections);
  metrics.add("device_losses_total", "counter", "times that the device was lost", state.render.losses);
  metrics.add("open_connections", "gauge", "connections open now", state.counts.connections.now);
  metrics.add("open_sessions", "gauge", "streams open now", state.counts.sessions.now);
  metrics.add("image_jobs", "gauge", "images of HTTP requests, from the order until they are sent",
              state.room.requests());
  metrics.add("pending_pixels", "gauge", "of 4 bytes, of pictures from the order until they are sent",
              state.room.held());
  metrics.add("frame_wait_seconds", "from a frame's order to its first turn", counters.frames.wait_time);
  metrics.add("frame_render_seconds", "a frame's turns on the device", counters.frames.render_time);
  metrics.add("frame_encode_seconds", "a frame in an encoder", counters.frames.encode_time);
  if (state.device != nullptr) {
    metrics.add("device_memory_used_bytes", "gauge", "device memory in use", state.render.memory_used_bytes);
    metrics.add("device_memory_budget_bytes", "gauge", "device memory to use", state.device->memory_budget_bytes);
    metrics.head("device_memory_part_bytes", "gauge", "device memory by what it holds");
    for (const auto& [part, bytes] : state.memory_parts) {
      metrics.text += fmt::format("blockwalk_device_memory_part_bytes{{part=\"{}\"}} {}\n", part, bytes);
    }
  }
  return std::move(metrics.text);
}

}  // namespace blockwalk
