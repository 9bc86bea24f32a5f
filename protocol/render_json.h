// SPDX-License-Identifier: Apache-2.0
// What a frame cost and what a device is, as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "view/device_info.h"
#include "view/frame.h"
#include "view/resolved_view.h"

namespace blockwalk {

// The interface's `stats`: X-Blockwalk-Stats, the stream's stats message, `blockwalk render --stats`.
nlohmann::json statsJson(const RenderStats& stats);

// {"width", "height", "channels", "type"} of format raw, type u8 or f32 little endian: X-Blockwalk-Raw.
nlohmann::json rawJson(const ResolvedView& view);

nlohmann::json deviceJson(const DeviceInfo& device);

}  // namespace blockwalk
