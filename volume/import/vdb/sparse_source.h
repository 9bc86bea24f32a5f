// SPDX-License-Identifier: Apache-2.0
// A source over sparse grids that lie in one index space: what is not active in any of them is blank.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "volume/import/import.h"
#include "volume/import/vdb/sparse_grid.h"
#include "volume/source.h"

namespace blockwalk {

// One sample of a voxel.
struct SparsePlane {
  std::size_t grid = 0;
  int component = 0;
  // Above 0: floats become u8, sample * scale rounded and held to 0..255.
  double scale = 0;
  bool keeps_some = false;  // what is above 0 becomes 1 at least
};

struct SparseParts {
  std::vector<std::shared_ptr<const SparseGrid>> grids;  // finished
  std::vector<SparsePlane> planes;                       // of one type and all with a scale, or all without one
  bool is_color = false;                                 // what the planes are where the options leave it open
};

// `info` has name, format and world_from_index, here of the file's index space, where a voxel has its centre at whole
// numbers; the rest of it follows. Throws DataError for a box of active voxels with a side above kMaxDim.
std::unique_ptr<Source> makeSparseSource(SparseParts parts, SourceInfo info, const ImportOptions& options);

}  // namespace blockwalk
