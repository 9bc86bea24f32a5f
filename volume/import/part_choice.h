// SPDX-License-Identifier: Apache-2.0
// Which part of an array of several axes a volume is made of, and what of it is told.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "volume/import/chunk_lattice.h"
#include "volume/import/import.h"

namespace blockwalk {

// The step in time that the options choose of `steps`, and a note of it where there are several. Throws DataError for
// one that is not there.
std::uint64_t chosenStep(const ImportOptions& options, std::uint64_t steps, const std::string& name,
                         std::vector<std::string>& notes);

// Sets dims and channels from the lengths of the axes; notes the channels that a volume has no place for. Throws
// DataError for sides that are none.
void setPartSizes(const std::vector<std::uint64_t>& shape, const std::string& name, ArrayPart& part,
                  std::vector<std::string>& notes);

}  // namespace blockwalk
