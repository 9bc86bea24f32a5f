// SPDX-License-Identifier: Apache-2.0
#include "volume/build/fitting_sides.h"

#include "volume/volume.h"

namespace blockwalk {

double paddingFactor(glm::ivec3 dims, int subblock_side) {
  const glm::ivec3 padded = latticeDims(dims, subblock_side) * subblock_side;
  double factor = 1;
  for (int i = 0; i < 3; ++i) factor *= static_cast<double>(padded[i]) / dims[i];
  return factor;
}

int fittingSubblockSide(glm::ivec3 dims) { return paddingFactor(dims, 4) <= 0.75 * paddingFactor(dims, 8) ? 4 : 8; }

}  // namespace blockwalk
