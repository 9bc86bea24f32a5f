// SPDX-License-Identifier: Apache-2.0
// Which voxels of a volume are asked for, as numbers and not as a picture.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "volume/voxel_box.h"

namespace blockwalk {

struct RegionRequest {
  std::string format = "nrrd";  // or "npy", "raw"
  int level = 0;
  std::optional<VoxelBox> box = std::nullopt;  // voxels of the level; else all of it
  std::vector<int> channels = {};              // in this order; else all
  bool operator==(const RegionRequest&) const = default;
};

// From the members of a query. Throws ViewError naming the member and the bound: unknown, repeated, or out of bounds
// whatever the volume is.
RegionRequest readRegionRequest(const std::vector<std::pair<std::string, std::string>>& members);

// The other way: parsing it gives the same request.
std::string regionQuery(const RegionRequest& request);

}  // namespace blockwalk
