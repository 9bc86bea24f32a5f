// SPDX-License-Identifier: Apache-2.0
// Rays of the reference renderer, in double precision: from a pixel to index space, cut to the boxes, through the
// cells.
//
// t is the distance from the eye in world units, also in index space, whose directions are not unit vectors.
#pragma once

#include <algorithm>
#include <glm/glm.hpp>
#include <limits>

#include "tests/reference/dense_volume.h"
#include "view/view.h"

namespace blockwalk::reference {

struct Ray {
  glm::dvec3 origin{0};
  glm::dvec3 direction{0};
  glm::dvec3 at(double t) const { return origin + t * direction; }
};

struct Interval {
  double t_min = 0;
  double t_max = 0;
};

constexpr glm::dvec2 kPixelCentre{0.5, 0.5};

// The ray through a place in pixel (x, y), row 0 at the top; the place is 0..1 to the right and downwards. The view is
// resolved: eye, target and up are there.
// `lens`: where on a lens of radius 1 it starts, to the right and up.
Ray worldRay(const View& resolved, int x, int y, glm::dvec2 place = kPixelCentre, glm::dvec2 lens = {0, 0});

// The same ray in the index space of the volume's level.
Ray indexRay(const DenseVolume& volume, const Ray& world);

// The part of `interval` that lies in [lo, hi); t_max <= t_min when there is none.
Interval cutToBox(const Ray& ray, glm::dvec3 lo, glm::dvec3 hi, Interval interval);

// Distance of the ray's piece from t_min to t_max to the twelve edges of the unit cube at `cell`. The piece must lie in
// the cell.
double edgeDistance(const Ray& ray, glm::dvec3 cell, Interval piece);

// Distance of the whole half-line t >= 0 to the twelve edges of a box.
double boxEdgeDistance(const Ray& ray, glm::dvec3 lo, glm::dvec3 hi);

// The cell of `side` voxels in which the ray is just after t_min.
glm::ivec3 cellAfter(const Ray& ray, int side, double t_min);

// Visits the cells of `side` voxels that the ray crosses with positive length within the interval, in order:
// visit(cell, piece) -> false to stop.
template <typename Visit>
void walkCells(const Ray& ray, int side, Interval interval, Visit visit) {
  if (!(interval.t_max > interval.t_min)) return;
  glm::ivec3 cell = cellAfter(ray, side, interval.t_min);
  double t = interval.t_min;
  while (t < interval.t_max) {
    glm::dvec3 t_leave(std::numeric_limits<double>::infinity());
    for (int a = 0; a < 3; ++a) {
      if (ray.direction[a] == 0) continue;
      const int plane = side * (cell[a] + (ray.direction[a] > 0 ? 1 : 0));
      t_leave[a] = (plane - ray.origin[a]) / ray.direction[a];
    }
    const double t_next = std::min({t_leave.x, t_leave.y, t_leave.z});
    const Interval piece{t, std::min(t_next, interval.t_max)};
    if (piece.t_max > piece.t_min && !visit(cell, piece)) return;
    // Planes met at the same t are crossed together: a cell touched in an edge or a corner has no length.
    for (int a = 0; a < 3; ++a) {
      if (t_leave[a] == t_next) cell[a] += ray.direction[a] > 0 ? 1 : -1;
    }
    t = t_next;
  }
}

}  // namespace blockwalk::reference
