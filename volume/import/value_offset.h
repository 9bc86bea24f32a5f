// SPDX-License-Identifier: Apache-2.0
// Values that 32-bit floats round, as they are far from 0 and near each other.
#pragma once

#include <optional>

#include "volume/source.h"

namespace blockwalk {

// What is to be taken off every value of the source so that the differences between them are kept
// (ImportOptions::value_offset): a whole number near their middle. Nothing where none is rounded, or where that would
// gain less than two bits. Of sources that say `may_round` alone; reads as much as tells it, which is all of it only
// where there is something to gain. Throws DataError.
std::optional<double> offsetThatKeeps(Source& source);

}  // namespace blockwalk
