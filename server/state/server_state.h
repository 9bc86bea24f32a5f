// SPDX-License-Identifier: Apache-2.0
// What the socket thread knows: plain data, from which replies are made. Only that thread touches it, so there is no
// lock.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "server/base/counted.h"
#include "server/base/options.h"
#include "server/http/rules.h"
#include "server/http/static_pages.h"
#include "server/render/frame_counters.h"
#include "server/render/pixel_room.h"
#include "server/state/catalog.h"

namespace blockwalk {

// Counted since the start.
struct ServerCounters {
  std::uint64_t requests = 0;
  std::uint64_t refused_requests = 0;  // answered with 4xx
  std::uint64_t failed_requests = 0;   // answered with 5xx
  std::uint64_t sent_bytes = 0;
  std::uint64_t sessions = 0;
  std::uint64_t evicted_connections = 0;  // closed to make place for others
  std::uint64_t dropped_views = 0;        // that no frame showed
  FrameCounters frames;
};

// What there is now.
struct ServerCounts {
  Count connections;
  Count sessions;
};

struct ServerState {
  ServerOptions options;
  HttpRules rules;
  Catalog catalog;
  StaticPages pages;
  std::shared_ptr<const DeviceInfo> device = {};  // null until there is one
  RenderStatus render = {};
  std::map<std::string, std::uint64_t> memory_parts = {};  // bytes on the device by what they are
  ServerCounters counters = {};
  ServerCounts counts = {};
  PixelRoom room;
  bool draining = false;

  bool hasDevice() const { return device != nullptr && render.state == DeviceState::ready; }
};

// Prometheus text.
std::string metricsText(const ServerState& state);

}  // namespace blockwalk
