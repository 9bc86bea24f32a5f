// SPDX-License-Identifier: Apache-2.0
// Where the voxels of a NRRD file lie in the space of its header.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "volume/import/geometry.h"
#include "volume/import/text/nrrd_fields.h"

namespace blockwalk {

// `sizes`: of all axes of the file; `axes`: those of them that are of space, x first. Throws DataError naming the
// field.
Geometry readNrrdPlace(const NrrdFields& fields, std::span<const std::int64_t> sizes,
                       std::span<const std::size_t> axes);

// The fields that say how far apart samples are; empty: none does.
std::string nrrdSpacingFields(const NrrdFields& fields);

}  // namespace blockwalk
