// SPDX-License-Identifier: Apache-2.0
// The last pass: everything is known, and the file is written from its front to its end, the header last.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "volume/build/builder.h"
#include "volume/build/levels.h"
#include "volume/build/workers.h"

namespace blockwalk {

// Writes the file and gives it its name.
// `info` is complete.
BuildReport writeVolume(const std::filesystem::path& path, const VolumeInfo& info, const BuiltLevels& built,
                        const Spill& spill, const BuildOptions& options, Workers& workers);

}  // namespace blockwalk
