// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/clip_planes.h"

#include <algorithm>
#include <iterator>

namespace blockwalk {
namespace {

// With a unit normal. Lengths that a double's square cannot hold are divided twice.
ClipPlane normalized(const ClipPlane& plane) {
  const glm::dvec3 size = glm::abs(plane.normal);
  const double largest = std::max({size.x, size.y, size.z});
  const glm::dvec3 normal = plane.normal / largest;
  const double length = glm::length(normal);
  return {.normal = normal / length, .offset = plane.offset / largest / length};
}

}  // namespace

std::vector<ClipPlane> cuttingPlanes(const ResolvedView& view, const VolumeInfo& info) {
  std::vector<ClipPlane> planes;
  for (int axis = 0; view.clip && axis < 3; ++axis) {
    glm::dvec3 normal(0);
    normal[axis] = 1;
    planes.push_back({.normal = normal, .offset = -view.clip->min[axis]});
    planes.push_back({.normal = -normal, .offset = view.clip->max[axis]});
  }
  std::ranges::transform(view.planes, std::back_inserter(planes), normalized);
  std::erase_if(planes, [corners = worldCorners(info)](const ClipPlane& plane) {
    return std::ranges::all_of(corners,
                               [&](const glm::dvec3& p) { return glm::dot(plane.normal, p) + plane.offset >= 0; });
  });
  return planes;
}

}  // namespace blockwalk
