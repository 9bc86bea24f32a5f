// SPDX-License-Identifier: Apache-2.0
// Which voxels of a volume are asked for, as numbers and not as a picture.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocol/query_member.h"
#include "volume/voxel_box.h"

namespace blockwalk {

inline constexpr std::array kRegionMembers = {
    QueryMember{"format", "nrrd|npy|raw", "of the reply (nrrd)"},
    QueryMember{"level", "N", "resolution level, 0 is the finest (0)"},
    QueryMember{"time", "N", "step in time of a volume that has several, counted from 0 (0)"},
    QueryMember{"box", "x0,y0,z0,x1,y1,z1", "voxels of the level, the last three not with it (all)"},
    QueryMember{"channels", "0,2,...", "channels of the volume, in this order (all)"}};

struct RegionRequest {
  std::string format = "nrrd";  // or "npy", "raw"
  int level = 0;
  int time = 0;                                // step
  std::optional<VoxelBox> box = std::nullopt;  // voxels of the level; else all of it
  std::vector<int> channels = {};              // in this order; else all
  bool operator==(const RegionRequest&) const = default;
};

// x0,y0,z0,x1,y1,z1, of which the first three are less than the others. Throws ViewError.
VoxelBox parseVoxelBox(std::string_view field, std::string_view text);

// From the members of a query. Throws ViewError naming the member and the bound: unknown, repeated, or out of bounds
// whatever the volume is.
RegionRequest readRegionRequest(const std::vector<std::pair<std::string, std::string>>& members);

// The other way: parsing it gives the same request.
std::string regionQuery(const RegionRequest& request);

}  // namespace blockwalk
