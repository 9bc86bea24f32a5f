// SPDX-License-Identifier: Apache-2.0
#include "view/polytope.h"

#include <algorithm>
#include <cmath>

namespace blockwalk {
namespace {

// Of the box's side: what is thinner is nothing.
constexpr double kThin = 1e-9;

ClipPlane through(const glm::dvec3& point, const glm::dvec3& normal) {
  return {.normal = normal, .offset = -glm::dot(normal, point)};
}

// In the coordinates in which the box is the unit cube, with a normal of length 1; a normal of length 0 stays.
ClipPlane inUnitCube(const VolumeInfo& info, const ClipPlane& plane) {
  const double largest = std::max({std::abs(plane.normal.x), std::abs(plane.normal.y), std::abs(plane.normal.z)});
  const glm::dvec3 world_normal = plane.normal / largest;  // its square may be more than a double holds
  const glm::dmat4& map = info.world_from_index;
  const glm::dvec3 normal = world_normal * glm::dmat3(map) * glm::dvec3(info.dims);
  const double offset = glm::dot(world_normal, glm::dvec3(map[3])) + plane.offset / largest;
  const double length = glm::length(normal);
  return {.normal = normal / length, .offset = offset / length};
}

}  // namespace

// What is bounded and not empty has a corner, where three of its planes meet.
bool leavesSome(const VolumeInfo& info, std::span<const ClipPlane> cuts, std::span<const ClipPlane> picture) {
  std::vector<ClipPlane> sides;
  for (int axis = 0; axis < 3; ++axis) {
    glm::dvec3 normal(0);
    normal[axis] = 1;
    sides.push_back({.normal = normal, .offset = 0});
    sides.push_back({.normal = -normal, .offset = 1});
  }
  for (const ClipPlane& plane : cuts) sides.push_back(inUnitCube(info, plane));
  for (ClipPlane& side : sides) side.offset -= kThin;
  for (const ClipPlane& plane : picture) sides.push_back(inUnitCube(info, plane));
  const auto is_inside = [&](const glm::dvec3& point) {
    return std::ranges::all_of(
        sides, [&](const ClipPlane& side) { return glm::dot(side.normal, point) + side.offset >= -0.5 * kThin; });
  };
  for (std::size_t i = 0; i < sides.size(); ++i) {
    for (std::size_t j = i + 1; j < sides.size(); ++j) {
      const glm::dvec3 along = glm::cross(sides[i].normal, sides[j].normal);
      for (std::size_t k = j + 1; k < sides.size(); ++k) {
        const double volume = glm::dot(along, sides[k].normal);
        if (std::abs(volume) < 1e-12) continue;  // two of them are parallel, or all to one line
        const glm::dvec3 corner =
            -(sides[i].offset * glm::cross(sides[j].normal, sides[k].normal) +
              sides[j].offset * glm::cross(sides[k].normal, sides[i].normal) + sides[k].offset * along) /
            volume;
        if (is_inside(corner)) return true;
      }
    }
  }
  return false;
}

std::vector<ClipPlane> clipPlanes(const ResolvedView& view) {
  std::vector<ClipPlane> planes = view.planes;
  for (int axis = 0; view.clip && axis < 3; ++axis) {
    glm::dvec3 normal(0);
    normal[axis] = 1;
    planes.push_back(through(view.clip->min, normal));
    planes.push_back(through(view.clip->max, -normal));
  }
  return planes;
}

std::vector<ClipPlane> picturePlanes(const Camera& camera) {
  std::vector<ClipPlane> planes = {through(camera.eye, camera.forward)};
  for (const double side : {-1.0, 1.0}) {
    for (const auto& [axis, half] : {std::pair{camera.right, camera.half_width}, {camera.up, camera.half_height}}) {
      if (camera.orthographic) {
        planes.push_back(through(camera.eye - side * half * axis, side * axis));
      } else {
        planes.push_back(through(camera.eye, half * camera.forward + side * axis));
      }
    }
  }
  return planes;
}

}  // namespace blockwalk
