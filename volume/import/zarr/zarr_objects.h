// SPDX-License-Identifier: Apache-2.0
// Which objects of the part of an array that a volume is made of there are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "volume/import/chunk_lattice.h"
#include "volume/import/zarr/zarr_array.h"
#include "volume/import/zarr/zarr_store.h"

namespace blockwalk {

// The numbers of the objects that are there, ascending: by a look into folders, not at objects. Nothing where there are
// more than `most`.
std::optional<std::vector<std::uint64_t>> presentObjects(const ZarrStore& store, const ZarrArray& array,
                                                         const ArrayPart& part, const ChunkLattice& objects,
                                                         std::size_t most);

}  // namespace blockwalk
