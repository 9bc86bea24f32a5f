// SPDX-License-Identifier: Apache-2.0
#include "view/motion.h"

#include <cmath>

namespace blockwalk {
namespace {

glm::dmat3 axesOf(const Camera& camera) { return {camera.right, camera.up, camera.forward}; }

}  // namespace

std::optional<ResolvedView> movedOn(const ResolvedView& before, const ResolvedView& now, int times) {
  ResolvedView other = before;
  other.width = now.width;
  other.height = now.height;
  other.camera = now.camera;
  other.target = now.target;
  other.up = now.up;
  Camera still = before.camera;
  still.half_width = now.camera.half_width;  // that of another size
  if (other != now || still == now.camera || still.orthographic != now.camera.orthographic) return {};
  const glm::dmat3 turn = axesOf(now.camera) * glm::transpose(axesOf(before.camera));
  const double width = now.camera.half_height / before.camera.half_height;
  ResolvedView next = now;
  for (int i = 0; i < times; ++i) {
    const auto moved = [&](glm::dvec3 point) { return now.camera.eye + turn * (point - before.camera.eye); };
    next.camera.eye = moved(next.camera.eye);
    next.target = moved(next.target);
    next.up = turn * next.up;
    next.camera.right = turn * next.camera.right;
    next.camera.up = turn * next.camera.up;
    next.camera.forward = turn * next.camera.forward;
    next.camera.half_height *= width;
    next.camera.half_width *= width;
  }
  const double sum = glm::length(next.camera.eye) + glm::length(next.target) + next.camera.half_height;
  return std::isfinite(sum) ? std::optional(next) : std::nullopt;
}

}  // namespace blockwalk
