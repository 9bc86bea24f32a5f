// SPDX-License-Identifier: Apache-2.0
// What is told of a source and kept with its volume: which fields say how large voxels are, and what it was read from.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "volume/source.h"

namespace blockwalk {

constexpr std::string_view kSpacingFromKey = "spacing_from";  // of the metadata
constexpr std::string_view kReadFromKey = "read_from";        // the same

// `fields`: those of the file that say it; empty: none does, and voxels are taken to be 1. --spacing goes before all.
void tellSpacing(const std::optional<glm::dvec3>& spacing, std::string_view fields, SourceInfo& info);

// "28 slices in 28 files", of `part` "slice".
void tellRead(std::uint64_t parts, std::string_view part, std::uint64_t files, SourceInfo& info);

}  // namespace blockwalk
