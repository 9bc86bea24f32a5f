// SPDX-License-Identifier: Apache-2.0
// What a frame cost and what a device is, as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "renderer/renderer.h"

namespace blockwalk {

// The interface's `stats`: X-Blockwalk-Stats, the stream's stats message, `blockwalk render --stats`.
nlohmann::json statsJson(const RenderStats& stats);

nlohmann::json deviceJson(const DeviceInfo& device);

}  // namespace blockwalk
