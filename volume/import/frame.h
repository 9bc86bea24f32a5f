// SPDX-License-Identifier: Apache-2.0
// Which of several volumes of a file is meant.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "volume/import/import.h"

namespace blockwalk {

// The frame that the options choose of `frames`, and a note of it. Throws DataError, naming `source` and `field`, where
// they choose none of several, or one that is not there.
std::uint64_t chosenFrame(const ImportOptions& options, std::int64_t frames, const std::string& source,
                          const std::string& field, std::vector<std::string>& notes);

}  // namespace blockwalk
