// SPDX-License-Identifier: Apache-2.0
// The tree of a NanoVDB grid, walked with every offset checked.
#pragma once

#include <cstdint>
#include <memory>

#include "volume/import/vdb/grid_choice.h"
#include "volume/import/vdb/nano_file.h"
#include "volume/import/vdb/sparse_grid.h"

namespace blockwalk {

// What the head of the grid says. Throws DataError, naming the file, the grid and the field.
GridInfo nanoGridInfo(NanoBytes& bytes, const std::string& name);

// Its active voxels. `info` is nanoGridInfo()'s, without a refusal.
std::shared_ptr<const SparseGrid> readNanoTree(NanoBytes& bytes, const GridInfo& info, std::uint64_t most_bytes,
                                               const std::string& file);

}  // namespace blockwalk
