// SPDX-License-Identifier: Apache-2.0
// What a source is, in lines for people.
#pragma once

#include "volume/source.h"

namespace blockwalk {

// Format, spacing, unit and where that is said, what was read, place, space, channels with their maps of values, facts.
void printSource(const SourceInfo& info);

}  // namespace blockwalk
