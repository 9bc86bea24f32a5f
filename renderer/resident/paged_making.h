// SPDX-License-Identifier: Apache-2.0
// Opens a level whose voxels come and go (renderer/resident/pages.h): its records, of a window where there are many.
// What will not fit is refused before it is read, and what is read counts from then on.
#pragma once

#include "renderer/resident/page_pool.h"
#include "renderer/resident/pins.h"
#include "renderer/resident/visible_quarters.h"

namespace blockwalk {

// Part::voxels of a need that is paged: none of them, at first.
std::unique_ptr<Making> makePagedVoxels(Device& device, PagePool& pool, VisibleQuarters& quarters,
                                        const StoredVolume& volume, const Need& need);

}  // namespace blockwalk
