// SPDX-License-Identifier: Apache-2.0
// What OpenVDB reads of a file, as messages through a pipe; for a process of its own.
//
// Of a grid in the list: name, type, refusal, class (texts); SampleType (u8), components (i32), 1 where it is a level
// set (u8), 16 doubles of world_from_index by columns, active voxels and bytes (u64), creator (text).
// Of trees: VdbPart::grid with SampleType (u8), components (i32) and a background voxel, then VdbPart::leaf with origin
// (3 i32), LeafMask and voxels, and VdbPart::tile with origin (3 i32), the logarithm of its side (i32) and one voxel.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "volume/import/vdb/vdb_process.h"

namespace blockwalk {

enum class VdbPart : std::uint8_t { grid = 1, leaf = 2, tile = 3 };

// False in a build without OpenVDB, where the others are not to be called.
bool hasOpenVdb();

// Throws what OpenVDB throws.
void listVdbGrids(const std::string& path, PipeWriter& out);
// By their places in the list.
void readVdbTrees(const std::string& path, const std::vector<std::size_t>& grids, PipeWriter& out);

}  // namespace blockwalk
