// SPDX-License-Identifier: Apache-2.0
// A slice's values as a file: in the volume's own type, as an export has them.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "volume/export/export.h"
#include "volume/file/file.h"
#include "volume/slice/slice.h"

namespace blockwalk {

// nrrd: three axes, of which the cut's has one voxel as thick as the slab (of a plane the third), with its place in the
// world. npy: axes rows, columns; several channels in front of them, the four of a colour behind. raw: the same without
// a header. What is between whole numbers is rounded, halves away from zero; what is outside of the volume is not a
// number in f32 and 0 in the others.
std::vector<std::byte> sliceBytes(const VolumeFile& file, const SlicePlan& plan, const SlicePixels& pixels,
                                  ExportFormat format);

// As `blockwalk import --type` spells it.
std::string sliceType(const VolumeFile& file, const SlicePlan& plan);

}  // namespace blockwalk
