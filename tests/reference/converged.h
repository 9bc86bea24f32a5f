// SPDX-License-Identifier: Apache-2.0
// The linear filter's blend without a step: the integral of emission and absorption (Max 1995) through the trilinear
// field, which the lattice's midpoint rule and pre-integration approach for small steps. To a relative 1e-10.
//
// A ray is split at every face between cells of eight voxel centres, inside which each field is a cubic in t, and where
// the density crosses an end of what is visible or a point of the transfer function. In between all is smooth, but for
// a light that turns its side, and Gauss's rule with 16 nodes is halved until two halves agree with their whole.
#pragma once

#include "tests/reference/reference.h"

namespace blockwalk::reference {

// Mode blend, filter linear; step, classification and samples are not looked at.
Pixel renderPixelConverged(const DenseVolume& volume, const View& resolved, int x, int y,
                           glm::dvec2 place = kPixelCentre);

Image renderImageConverged(const DenseVolume& volume, const View& resolved);

}  // namespace blockwalk::reference
