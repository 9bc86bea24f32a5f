// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/level_window.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "renderer/plan/level_needs.h"

namespace blockwalk {
namespace {

constexpr int kStep = 8;       // blocks, by which a window moves
constexpr double kMargin = 3;  // voxels of the level: the filter's, the light's, and a float's roundings

struct Depths {
  double begin = std::numeric_limits<double>::infinity();
  double end = -std::numeric_limits<double>::infinity();
};

Depths depthsOf(const ResolvedView& view, const VolumeInfo& info) {
  Depths depths;
  for (const glm::dvec3& corner : worldCorners(info)) {
    const double depth = glm::dot(corner - view.camera.eye, view.camera.forward);
    depths.begin = std::min(depths.begin, depth);
    depths.end = std::max(depths.end, depth);
  }
  return depths;
}

// Least and greatest along each axis.
struct IndexBox {
  glm::dvec3 min{std::numeric_limits<double>::infinity()};
  glm::dvec3 max{-std::numeric_limits<double>::infinity()};
  void add(glm::dvec3 point) {
    min = glm::min(min, point);
    max = glm::max(max, point);
  }
};

}  // namespace

bool isWindowed(const VolumeInfo& info, int level, Form form, const DeviceTraits& device) {
  if (device.record_room_bytes == 0) return false;
  return levelNeeds(info, info.level(level, form)).record_bytes > device.record_room_bytes;
}

BlockWindow levelWindow(const ResolvedView& view, const VolumeInfo& info, int level, double near, double far) {
  const Camera& camera = view.camera;
  const Depths depths = depthsOf(view, info);
  const double begin = camera.orthographic ? depths.begin : std::max({near, depths.begin, 0.0});
  const double end = std::max(std::min(far, depths.end), begin);
  const glm::dmat4 index_from_world = glm::inverse(info.world_from_index);
  const auto indexOf = [&](const glm::dvec3& world) {
    return glm::dvec3(index_from_world * glm::dvec4(world, 1)) / std::ldexp(1.0, level);
  };
  IndexBox seen;
  for (const double depth : {begin, end}) {
    const double widening = camera.orthographic ? 1 : depth;
    for (int corner = 0; corner < 4; ++corner) {
      const glm::dvec3 right = ((corner & 1) != 0 ? 1.0 : -1.0) * widening * camera.half_width * camera.right;
      const glm::dvec3 up = ((corner & 2) != 0 ? 1.0 : -1.0) * widening * camera.half_height * camera.up;
      seen.add(indexOf(camera.eye + depth * camera.forward + right + up));
    }
  }
  // Rays go anywhere.
  if (hasSecondaryRays(view) || hasLens(view)) {
    for (const glm::dvec3& corner : worldCorners(info)) seen.add(indexOf(corner));
  }
  if (view.clip) {
    IndexBox kept;
    for (int corner = 0; corner < 8; ++corner) {
      const glm::dvec3 at(corner & 1, corner >> 1 & 1, corner >> 2);
      kept.add(indexOf(view.clip->min + at * (view.clip->max - view.clip->min)));
    }
    seen.min = glm::max(seen.min, kept.min);
    seen.max = glm::min(seen.max, kept.max);
  }
  const glm::ivec3 lattice = latticeDims(levelDims(info.dims, level), info.blockVoxels());
  const double step = static_cast<double>(kStep) * info.blockVoxels();
  BlockWindow window;
  for (int axis = 0; axis < 3; ++axis) {
    // Where nothing is seen of the volume the nearest step of it, so that there is something to bind.
    const double steps = std::ceil(static_cast<double>(lattice[axis]) / kStep);
    const double first = std::clamp(std::floor((seen.min[axis] - kMargin) / step), 0.0, steps - 1);
    const double last = std::clamp(std::floor((seen.max[axis] + kMargin) / step), first, steps - 1);
    window.begin[axis] = static_cast<int>(first) * kStep;
    window.end[axis] = (static_cast<int>(last) + 1) * kStep;
  }
  return window;
}

void chooseWindows(const ResolvedView& view, const VolumeInfo& info, const DeviceTraits& device, Plan& plan) {
  // Where the part of rays that a level is drawn on ends: it may begin anywhere, where opacity says so.
  const auto endOf = [&](std::size_t far) { return far < plan.farCount() ? plan.coarse[far].depth : kInfinity; };
  if (isWindowed(info, plan.level, plan.form, device)) plan.window = levelWindow(view, info, plan.level, 0, endOf(0));
  for (std::size_t i = 0; i < plan.coarse.size(); ++i) {
    CoarsePlan& far = plan.coarse[i];
    if (!far.paged || !isWindowed(info, far.level, far.form, device)) continue;
    far.window = levelWindow(view, info, far.level, far.transmittance > 0 ? 0 : far.depth, endOf(i + 1));
  }
}

std::uint64_t cellsIn(const BlockWindow& window) { return cellCount(window.end - window.begin); }

std::uint64_t windowCells(const Plan& plan) {
  std::uint64_t cells = plan.window == BlockWindow{} ? 0 : cellsIn(plan.window);
  for (const CoarsePlan& far : plan.coarse) {
    if (far.window != BlockWindow{}) cells = std::max(cells, cellsIn(far.window));
  }
  return cells;
}

}  // namespace blockwalk
