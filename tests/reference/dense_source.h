// SPDX-License-Identifier: Apache-2.0
// A dense volume of level 0 as a source, so that analytic volumes can be built into files and drawn by the kernels.
#pragma once

#include <memory>

#include "tests/reference/dense_volume.h"
#include "volume/source.h"

namespace blockwalk::reference {

// The source keeps a copy. Voxels that are absent (NaN) become 0 in integer types. Whoever builds the file gives the
// empty threshold: BuildOptions::empty_threshold, data units.
std::unique_ptr<Source> makeDenseSource(DenseVolume volume);

}  // namespace blockwalk::reference
