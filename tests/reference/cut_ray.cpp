// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/cut_ray.h"

#include <algorithm>
#include <limits>

#include "volume/error.h"

namespace blockwalk::reference {

CutRay cutRay(const DenseVolume& volume, const View& view, int x, int y, glm::dvec2 place, glm::dvec2 lens) {
  return cutWorldRay(volume, view, worldRay(view, x, y, place, lens));
}

CutRay cutWorldRay(const DenseVolume& volume, const View& view, const Ray& world) {
  CutRay cut{.world = world,
             .ray = indexRay(volume, world),
             .interval = {.t_min = 0, .t_max = std::numeric_limits<double>::infinity()}};
  const glm::dvec3 box = glm::dvec3(volume.level0_dims) * std::ldexp(1.0, -volume.level);
  cut.interval = cutToBox(cut.ray, glm::dvec3(0), box, cut.interval);
  cut.edge_distance = boxEdgeDistance(cut.ray, glm::dvec3(0), box);
  cut.starts_inside = cut.interval.t_min == 0;
  if (view.clip) {
    const Interval clipped = cutToBox(world, view.clip->min, view.clip->max, cut.interval);
    cut.starts_inside = cut.starts_inside || clipped.t_min > cut.interval.t_min;
    cut.interval = clipped;
  }
  for (const ClipPlane& plane : view.planes) {
    // Inside where height + t slope >= 0.
    const double height = glm::dot(plane.normal, world.origin) + plane.offset;
    const double slope = glm::dot(plane.normal, world.direction);
    if (slope > 0 && -height / slope > cut.interval.t_min) {
      cut.interval.t_min = -height / slope;
      cut.starts_inside = true;
    }
    if (slope < 0) cut.interval.t_max = std::min(cut.interval.t_max, -height / slope);
    if (slope == 0 && height < 0) cut.interval.t_max = cut.interval.t_min - 1;
  }
  const double gap = std::abs(cut.interval.t_max - cut.interval.t_min) * glm::length(cut.ray.direction);
  cut.edge_distance = std::min(cut.edge_distance, gap);
  return cut;
}

double faceDistance(const CutRay& cut) {
  double distance = std::numeric_limits<double>::infinity();
  if (!(cut.interval.t_max > cut.interval.t_min)) return distance;
  const glm::dvec3 p = cut.ray.at(cut.interval.t_min);
  const glm::dvec3 q = cut.ray.at(cut.interval.t_max);
  for (int a = 0; a < 3; ++a) {
    const double plane = std::round(p[a]);
    distance = std::min(distance, std::max(std::abs(p[a] - plane), std::abs(q[a] - plane)));
  }
  return distance;
}

Lattice latticeOf(const DenseVolume& volume, const View& view, const CutRay& cut) {
  BLOCKWALK_CHECK(view.step, >, 0.0);
  glm::dvec3 lo(std::numeric_limits<double>::infinity()), hi(-lo);
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 index = glm::dvec3(volume.level0_dims) * glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2);
    const glm::dvec3 world(volume.world_from_index * glm::dvec4(index, 1));
    lo = glm::min(lo, world);
    hi = glm::max(hi, world);
  }
  const glm::dvec3 forward = glm::normalize(view.target.value() - view.eye.value());
  const double depth = glm::dot((lo + hi) / 2.0 - view.eye.value(), forward);
  const bool from_center = view.ortho_height.has_value() || depth > glm::length(hi - lo) / 2;
  if (cut.lattice_zero) return {.t_zero = *cut.lattice_zero, .dt = view.step / glm::length(cut.ray.direction)};
  return {.t_zero = from_center ? depth / glm::dot(cut.world.direction, forward) : 0,
          .dt = view.step / glm::length(cut.ray.direction)};
}

double latticeDistance(const Lattice& lattice, Interval interval) {
  double distance = std::numeric_limits<double>::infinity();
  for (double t : {interval.t_min, interval.t_max}) {
    const double k = (t - lattice.t_zero) / lattice.dt;
    distance = std::min(distance, std::abs(k - std::round(k)));
  }
  return distance;
}

}  // namespace blockwalk::reference
