// SPDX-License-Identifier: Apache-2.0
// A pixel's ray, the part of it that there is anything to see on, and the lattice of samples along it
// (docs/integration.md, Samples).
#pragma once

#include <cmath>
#include <optional>

#include "tests/reference/dense_volume.h"
#include "tests/reference/ray.h"
#include "view/view.h"

namespace blockwalk::reference {

// A ray in world space and in the index space of one level, and the part of it that the volume, the clip box and the
// planes leave.
struct CutRay {
  Ray world;
  Ray ray;
  Interval interval;
  double edge_distance = 0;                 // to the edges of the boxes, in voxels
  bool starts_inside = false;               // at the eye or at a clip face, not at a face of the volume
  std::optional<double> lattice_zero = {};  // where its samples count from; else as of a ray from the eye
};

CutRay cutRay(const DenseVolume& volume, const View& view, int x, int y, glm::dvec2 place = kPixelCentre,
              glm::dvec2 lens = {0, 0});
CutRay cutWorldRay(const DenseVolume& volume, const View& view, const Ray& world);

// The ray stays within this distance of one plane of voxel faces all the way, in voxels.
double faceDistance(const CutRay& cut);

// Interval k of the lattice is [t_zero + k dt, t_zero + (k + 1) dt], t the distance from the eye.
struct Lattice {
  double t_zero = 0;
  double dt = 1;
  double at(double k) const { return t_zero + k * dt; }
};

Lattice latticeOf(const DenseVolume& volume, const View& view, const CutRay& cut);

// How near the ends of the ray's part are to a point of the lattice, in intervals: where a rounding makes or unmakes an
// interval.
double latticeDistance(const Lattice& lattice, Interval interval);

// Visits the intervals that have a positive length after the cut, in order: visit(piece) -> false to stop.
template <typename Visit>
void walkLattice(const Lattice& lattice, Interval interval, Visit visit) {
  if (!(interval.t_max > interval.t_min)) return;
  for (double k = std::floor((interval.t_min - lattice.t_zero) / lattice.dt) - 1; lattice.at(k) < interval.t_max; ++k) {
    const Interval piece{.t_min = std::max(interval.t_min, lattice.at(k)),
                         .t_max = std::min(interval.t_max, lattice.at(k + 1))};
    if (piece.t_max > piece.t_min && !visit(piece)) return;
  }
}

}  // namespace blockwalk::reference
