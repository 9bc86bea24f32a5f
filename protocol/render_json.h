// SPDX-License-Identifier: Apache-2.0
// What a frame cost and what a device is, as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "renderer/renderer.h"

namespace blockwalk {

// The interface's `stats`: X-Blockwalk-Stats, the stream's stats message, `blockwalk render --stats`.
nlohmann::json statsJson(const RenderStats& stats);

// {"width", "height", "channels", "type"} of format raw, type u8 or f32 little endian: X-Blockwalk-Raw.
nlohmann::json rawJson(const View& view);

nlohmann::json deviceJson(const DeviceInfo& device);

}  // namespace blockwalk
