// SPDX-License-Identifier: Apache-2.0
#include "renderer/view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace blockwalk {
namespace {

double halfSlope(const View& view) { return std::tan(view.fov_degrees * std::numbers::pi / 360); }

bool isFinite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// Far enough along (1, 0.8, 1.2) that the box's bounding sphere fits the image both ways.
glm::dvec3 framingEye(const View& view, const WorldBox& box, const glm::dvec3& target) {
  const double radius = 0.5 * glm::length(box.max - box.min);
  const double aspect = static_cast<double>(view.width) / view.height;
  const double narrow = std::atan(halfSlope(view) * std::min(1.0, aspect));
  return target + glm::normalize(glm::dvec3(1, 0.8, 1.2)) * (radius / std::sin(narrow));
}

void checkNumbers(const View& view) {
  if (view.width < 1 || view.width > kMaxImageSide || view.height < 1 || view.height > kMaxImageSide) {
    throw ViewError("size", fmt::format("{}x{} is not within 1..{} each way", view.width, view.height, kMaxImageSide));
  }
  if (!(view.fov_degrees > 0 && view.fov_degrees < 180)) {
    throw ViewError("fov", fmt::format("{} is not between 0 and 180 degrees", view.fov_degrees));
  }
  if (view.ortho_height && !(*view.ortho_height > 0 && std::isfinite(*view.ortho_height))) {
    throw ViewError("ortho", fmt::format("{} is not a positive world height", *view.ortho_height));
  }
  if (!(view.extinction >= 0 && std::isfinite(view.extinction))) {
    throw ViewError("extinction", fmt::format("{} is not a finite number of at least 0", view.extinction));
  }
}

void resolveCamera(View& view, const VolumeInfo& info) {
  const WorldBox box = worldBox(info);
  if (!view.target) view.target = 0.5 * (box.min + box.max);
  if (!view.eye) view.eye = framingEye(view, box, *view.target);
  if (!view.up) view.up = glm::dvec3(0, 1, 0);
  for (const auto& [value, field] : {std::pair{&view.eye, "eye"}, {&view.target, "target"}, {&view.up, "up"}}) {
    if (!isFinite(**value)) throw ViewError(field, "is not finite");
  }
  const glm::dvec3 toward = *view.target - *view.eye;
  const double distance = glm::length(toward);
  if (!(distance > 0) || !std::isfinite(distance))
    throw ViewError("target", "eye and target are the same point, or too far apart");
  const double up_length = glm::length(*view.up);
  if (!(up_length > 0) || !std::isfinite(up_length)) throw ViewError("up", "has no direction");
  if (glm::length(glm::cross(toward / distance, *view.up / up_length)) < 1e-9) {
    throw ViewError("up", "is parallel to the line of sight");
  }
}

void checkTransfer(const View& view) {
  for (std::size_t i = 0; i < view.transfer.size(); ++i) {
    const TransferPoint& point = view.transfer[i];
    if (!std::isfinite(point.value) || (i > 0 && point.value <= view.transfer[i - 1].value)) {
      throw ViewError("tf", fmt::format("point {}: values must be finite and ascend", i));
    }
    if (!(point.opacity >= 0 && point.opacity <= 1)) {
      throw ViewError("tf", fmt::format("point {}: opacity {} is not within 0..1", i, point.opacity));
    }
  }
}

}  // namespace

View resolveView(const View& view, const VolumeInfo& info) {
  checkNumbers(view);
  View resolved = view;
  resolveCamera(resolved, info);
  if (!resolved.range) {
    resolved.range = DensityRange{info.dataFromStored(info.density_min), info.dataFromStored(info.density_max)};
  }
  if (!(resolved.range->lo <= resolved.range->hi) || !std::isfinite(resolved.range->lo) ||
      !std::isfinite(resolved.range->hi)) {
    throw ViewError("range",
                    fmt::format("{}:{} is not a lower and an upper bound", resolved.range->lo, resolved.range->hi));
  }
  if (info.type == VoxelType::rgba8) {
    if (!resolved.transfer.empty()) throw ViewError("tf", "this volume has its own colours (rgba8); use extinction");
  } else if (resolved.transfer.empty()) {
    resolved.transfer = defaultTransfer(info);
  }
  checkTransfer(resolved);
  if (resolved.clip) {
    for (int axis = 0; axis < 3; ++axis) {
      const double lo = resolved.clip->min[axis];
      const double hi = resolved.clip->max[axis];
      if (!(lo <= hi) || !std::isfinite(lo) || !std::isfinite(hi)) {
        throw ViewError("clip", fmt::format("{}..{} along {} is not a lower and an upper bound", lo, hi, "xyz"[axis]));
      }
    }
  }
  const auto levels = static_cast<int>(info.levels.size());
  if (resolved.level != kAutoLevel && (resolved.level < 0 || resolved.level >= levels)) {
    throw ViewError("level", fmt::format("{} is not within 0..{}", resolved.level, levels - 1));
  }
  return resolved;
}

Camera makeCamera(const View& resolved) {
  Camera camera;
  camera.eye = *resolved.eye;
  camera.forward = glm::normalize(*resolved.target - *resolved.eye);
  camera.right = glm::normalize(glm::cross(camera.forward, glm::normalize(*resolved.up)));
  camera.up = glm::cross(camera.right, camera.forward);
  camera.orthographic = resolved.ortho_height.has_value();
  camera.half_height = camera.orthographic ? 0.5 * *resolved.ortho_height : halfSlope(resolved);
  camera.half_width = camera.half_height * resolved.width / resolved.height;
  return camera;
}

}  // namespace blockwalk
