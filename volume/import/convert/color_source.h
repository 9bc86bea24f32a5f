// SPDX-License-Identifier: Apache-2.0
// Colours whose samples lie in planes of their own, as channels do.
#pragma once

#include <memory>

#include "volume/import/import.h"
#include "volume/source.h"

namespace blockwalk {

// A source of colours from one of two to four channels, which are what VoxelConverter takes samples of a colour for:
// grey and alpha, RGB, RGBA. Throws DataError where the channels are none of u8 or u16.
std::unique_ptr<Source> makeColorSource(std::unique_ptr<Source> channels, const ImportOptions& options);

}  // namespace blockwalk
