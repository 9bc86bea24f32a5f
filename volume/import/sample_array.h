// SPDX-License-Identifier: Apache-2.0
// A source over one dense array of samples: what raw, NRRD and MetaImage files hold.
#pragma once

#include <memory>

#include "volume/import/byte_reader.h"
#include "volume/import/voxel_converter.h"
#include "volume/source.h"

namespace blockwalk {

// `info` has name, format, dims and world_from_index; type, offset and random access follow from the other two.
std::unique_ptr<Source> makeSampleArray(SourceInfo info, VoxelConverter converter, std::unique_ptr<ByteReader> bytes);

}  // namespace blockwalk
