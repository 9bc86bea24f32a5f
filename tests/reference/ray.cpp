// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/ray.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace blockwalk::reference {
namespace {

// Distance in the plane from a point to the segment from p to q.
double segmentDistance(glm::dvec2 point, glm::dvec2 p, glm::dvec2 q) {
  const glm::dvec2 along = q - p;
  const double length2 = glm::dot(along, along);
  const double s = length2 > 0 ? std::clamp(glm::dot(point - p, along) / length2, 0.0, 1.0) : 0.0;
  return glm::length(p + s * along - point);
}

}  // namespace

Ray worldRay(const View& resolved, int x, int y, glm::dvec2 place, glm::dvec2 lens) {
  const glm::dvec3 eye = resolved.eye.value();
  const glm::dvec3 forward = glm::normalize(resolved.target.value() - eye);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, resolved.up.value()));
  const glm::dvec3 up = glm::cross(right, forward);
  const double half_height =
      resolved.ortho_height ? *resolved.ortho_height / 2 : std::tan(resolved.fov_degrees * std::numbers::pi / 360);
  const double half_width = half_height * resolved.width / resolved.height;
  const double u = ((x + place.x) / resolved.width * 2 - 1) * half_width;
  const double v = (1 - (y + place.y) / resolved.height * 2) * half_height;
  const glm::dvec3 offset = u * right + v * up;
  if (resolved.ortho_height) return {.origin = eye + offset, .direction = forward};
  // All that meet in one point where it is sharp.
  const double focus = resolved.focus == kAtTarget ? glm::dot(resolved.target.value() - eye, forward) : resolved.focus;
  const glm::dvec3 start = eye + resolved.aperture * (lens.x * right + lens.y * up);
  const glm::dvec3 sharp = eye + focus * (forward + offset);
  return {.origin = start, .direction = glm::normalize(sharp - start)};
}

Ray indexRay(const DenseVolume& volume, const Ray& world) {
  const glm::dmat4 index_from_world = glm::inverse(volume.world_from_index);
  const double scale = std::ldexp(1.0, -volume.level);
  return {.origin = glm::dvec3(index_from_world * glm::dvec4(world.origin, 1)) * scale,
          .direction = glm::dvec3(index_from_world * glm::dvec4(world.direction, 0)) * scale};
}

Interval cutToBox(const Ray& ray, glm::dvec3 lo, glm::dvec3 hi, Interval interval) {
  for (int a = 0; a < 3; ++a) {
    if (ray.direction[a] == 0) {
      if (ray.origin[a] < lo[a] || ray.origin[a] >= hi[a]) return {.t_min = 0, .t_max = -1};
      continue;
    }
    const double t_lo = (lo[a] - ray.origin[a]) / ray.direction[a];
    const double t_hi = (hi[a] - ray.origin[a]) / ray.direction[a];
    interval.t_min = std::max(interval.t_min, std::min(t_lo, t_hi));
    interval.t_max = std::min(interval.t_max, std::max(t_lo, t_hi));
  }
  return interval;
}

double edgeDistance(const Ray& ray, glm::dvec3 cell, Interval piece) {
  const glm::dvec3 p = ray.at(piece.t_min) - cell;
  const glm::dvec3 q = ray.at(piece.t_max) - cell;
  double distance = std::numeric_limits<double>::infinity();
  for (int along = 0; along < 3; ++along) {
    const int a = (along + 1) % 3;
    const int b = (along + 2) % 3;
    for (int corner = 0; corner < 4; ++corner) {
      const glm::dvec2 point(corner & 1, corner >> 1);
      distance = std::min(distance, segmentDistance(point, {p[a], p[b]}, {q[a], q[b]}));
    }
  }
  return distance;
}

double boxEdgeDistance(const Ray& ray, glm::dvec3 lo, glm::dvec3 hi) {
  double distance = std::numeric_limits<double>::infinity();
  for (int along = 0; along < 3; ++along) {
    const int a = (along + 1) % 3;
    const int b = (along + 2) % 3;
    const glm::dvec2 direction(ray.direction[a], ray.direction[b]);
    const double length2 = glm::dot(direction, direction);
    for (int corner = 0; corner < 4; ++corner) {
      const glm::dvec2 edge((corner & 1) != 0 ? hi[a] : lo[a], (corner & 2) != 0 ? hi[b] : lo[b]);
      const glm::dvec2 origin(ray.origin[a], ray.origin[b]);
      const double t = length2 > 0 ? std::max(0.0, glm::dot(edge - origin, direction) / length2) : 0.0;
      // Only where the ray passes the edge itself, not the line that continues it.
      const double along_edge = ray.at(t)[along];
      const bool passes = along_edge >= lo[along] - 1 && along_edge <= hi[along] + 1;
      if (length2 > 0 && !passes) continue;
      distance = std::min(distance, glm::length(origin + t * direction - edge));
    }
  }
  return distance;
}

glm::ivec3 cellAfter(const Ray& ray, int side, double t_min) {
  const glm::dvec3 position = ray.at(t_min);
  glm::ivec3 cell = glm::ivec3(glm::floor(position / static_cast<double>(side)));
  for (int a = 0; a < 3; ++a) {
    const double direction = ray.direction[a];
    if (direction == 0) continue;
    // The position is rounded; the planes' t decide, as they do at every later step.
    const auto t_plane = [&](int plane) { return (side * plane - ray.origin[a]) / direction; };
    const int ahead = direction > 0 ? 1 : 0;
    const int forward = direction > 0 ? 1 : -1;
    while (t_plane(cell[a] + ahead) <= t_min) cell[a] += forward;
    while (t_plane(cell[a] + 1 - ahead) > t_min) cell[a] -= forward;
  }
  return cell;
}

}  // namespace blockwalk::reference
