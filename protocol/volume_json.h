// SPDX-License-Identifier: Apache-2.0
// What a volume is, as JSON: `blockwalk info --json`, GET /volumes/{id} and the stream's hello. Members:
// docs/protocol.md.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>

#include "volume/volume.h"

namespace blockwalk {

nlohmann::json volumeJson(const VolumeInfo& info, std::uint64_t file_bytes);

}  // namespace blockwalk
