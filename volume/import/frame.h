// SPDX-License-Identifier: Apache-2.0
// Which of several volumes of a file is meant.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "volume/import/import.h"

namespace blockwalk {

// The frame that the options choose of `frames`, else the first, and a note of it where there are several. Throws
// DataError, naming `source` and `field`, for one that is not there.
std::uint64_t chosenFrame(const ImportOptions& options, std::int64_t frames, const std::string& source,
                          const std::string& field, std::vector<std::string>& notes);

}  // namespace blockwalk
