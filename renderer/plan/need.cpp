// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/need.h"

#include <iterator>

namespace blockwalk {

std::string_view partName(Part part) {
  static constexpr std::string_view kNames[] = {"voxels",   "blocks",   "masks",  "quarters",  "empty",
                                                "table",    "grid",     "octree", "instances", "macrocells",
                                                "clusters", "boundary", "sums",   "ancestors"};
  static_assert(std::size(kNames) == kPartKinds);
  return kNames[static_cast<std::size_t>(part)];
}

}  // namespace blockwalk
