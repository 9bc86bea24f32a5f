// SPDX-License-Identifier: Apache-2.0
// The last pass: everything is known, and the file is written from its front to its end, the header last.
#pragma once

#include <cstdint>

#include "volume/build/builder.h"
#include "volume/build/levels.h"
#include "volume/build/storage.h"
#include "volume/build/workers.h"

namespace blockwalk {

// Writes the volume into `file` from `begin` on, and a reader would take it. `info` is complete.
BuildReport writeVolume(OutputFile& file, std::uint64_t begin, const VolumeInfo& info, const BuiltLevels& built,
                        const Spill& spill, const BuildOptions& options, Workers& workers);

}  // namespace blockwalk
