// SPDX-License-Identifier: Apache-2.0
// A source over a list of voxels with colours of a palette; all else is blank.
#pragma once

#include <memory>

#include "volume/import/grids/vox_scene.h"
#include "volume/import/import.h"
#include "volume/source.h"

namespace blockwalk {

// `info` has name, format and world_from_index; the rest of it follows.
std::unique_ptr<Source> makeVoxSource(VoxScene scene, SourceInfo info, const ImportOptions& options);

}  // namespace blockwalk
