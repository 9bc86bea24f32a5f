// SPDX-License-Identifier: Apache-2.0
#include "view/resolved_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "view/first_look.h"

namespace blockwalk {
namespace {

double halfSlope(const View& view) { return std::tan(view.fov_degrees * std::numbers::pi / 360); }

bool isFinite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// The up vector to frame with; one that cannot be used is refused after framing.
glm::dvec3 framingUp(const FirstLook& look, const glm::dvec3& up) {
  const glm::dvec3 across = glm::cross(glm::normalize(look.from), up);
  const double length = glm::length(across);
  return length > 0 && std::isfinite(length) ? up : look.up;
}

// Along `from` from the target, as near as the box still fits the image with a small margin.
glm::dvec3 framingEye(const View& view, const WorldBox& box, const glm::dvec3& target, const glm::dvec3& from,
                      const glm::dvec3& up) {
  const glm::dvec3 forward = -glm::normalize(from);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, up));
  const glm::dvec3 image_up = glm::cross(right, forward);
  const double slope_y = halfSlope(view);
  const double slope_x = slope_y * view.width / view.height;
  double distance = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 side(corner & 1, corner >> 1 & 1, corner >> 2);
    const glm::dvec3 offset = box.min + side * (box.max - box.min) - target;
    const double depth = glm::dot(offset, forward);
    distance = std::max({distance, std::abs(glm::dot(offset, right)) / slope_x - depth,
                         std::abs(glm::dot(offset, image_up)) / slope_y - depth});
  }
  return target - forward * (1.04 * distance);
}

void checkNumbers(const View& view) {
  if (view.width < 1 || view.width > kMaxImageSide || view.height < 1 || view.height > kMaxImageSide) {
    throw ViewError("size", fmt::format("{}x{} is not within 1..{} each way", view.width, view.height, kMaxImageSide));
  }
  if (!(view.fov_degrees >= kMinFov && view.fov_degrees < 180)) {
    throw ViewError("fov", fmt::format("{} is not at least {} and less than 180 degrees", view.fov_degrees, kMinFov));
  }
  if (view.ortho_height && !(*view.ortho_height > 0 && std::isfinite(*view.ortho_height))) {
    throw ViewError("ortho", fmt::format("{} is not a positive world height", *view.ortho_height));
  }
  if (!(view.extinction >= 0 && std::isfinite(view.extinction))) {
    throw ViewError("extinction", fmt::format("{} is not a finite number of at least 0", view.extinction));
  }
  if (!(view.attenuation >= 0 && view.attenuation <= kMaxAttenuation)) {
    throw ViewError("attenuation", fmt::format("{} is not within 0..{}", view.attenuation, kMaxAttenuation));
  }
  if (!(view.termination >= 0 && view.termination <= 0.5)) {
    throw ViewError("termination", fmt::format("{} is not within 0..0.5", view.termination));
  }
  if (!(view.step >= kMinStep && view.step <= kMaxStep)) {
    throw ViewError("step", fmt::format("{} is not within {}..{} voxels", view.step, kMinStep, kMaxStep));
  }
  if (view.lod != kOneLevel && !(view.lod >= kMinLod && view.lod <= kMaxLod)) {
    throw ViewError("lod", fmt::format("{} is not within {}..{}, nor off", view.lod, kMinLod, kMaxLod));
  }
  if (!(view.lod_alpha >= 0 && view.lod_alpha <= 1)) {
    throw ViewError("lod-alpha", fmt::format("{} is not within 0..1", view.lod_alpha));
  }
}

void checkLight(const View& view) {
  const Lights& lights = view.lights;
  for (const double strength : {lights.ambient, lights.head, lights.key, lights.highlight}) {
    if (!(strength >= 0 && strength <= kMaxLight)) {
      throw ViewError("light", fmt::format("{} is not within 0..{}", strength, kMaxLight));
    }
  }
  const double length = glm::length(view.key_light);
  if (!(length > 0) || !std::isfinite(length)) throw ViewError("key-light", "has no direction");
  if (!(view.occlusion >= 0 && view.occlusion <= kMaxReach)) {
    throw ViewError("occlusion", fmt::format("{} is not within 0..{} unit distances", view.occlusion, kMaxReach));
  }
}

void checkLens(const View& view, const WorldBox& box) {
  const double diagonal = glm::length(box.max - box.min);
  if (!(view.aperture >= 0 && view.aperture <= diagonal)) {
    throw ViewError("aperture", fmt::format("{} is not within 0..{}, the volume's diagonal", view.aperture, diagonal));
  }
  if (view.aperture > 0 && view.ortho_height) {
    throw ViewError("aperture", "a lens needs a perspective view: use fov, not ortho");
  }
  if (!(view.focus >= 0) || !std::isfinite(view.focus)) {
    throw ViewError("focus", fmt::format("{} is not a distance before the eye", view.focus));
  }
}

void checkMacrocell(const View& view) {
  if (view.macrocell != kAutoMacrocell && view.macrocell != 8 && view.macrocell != 16 && view.macrocell != 32) {
    throw ViewError("macrocell", fmt::format("{} is not 8, 16 or 32 voxels", view.macrocell));
  }
}

Camera cameraAt(const View& view, const glm::dvec3& eye, const glm::dvec3& toward, const glm::dvec3& up) {
  Camera camera;
  camera.eye = eye;
  camera.forward = glm::normalize(toward);
  camera.right = glm::normalize(glm::cross(camera.forward, glm::normalize(up)));
  camera.up = glm::cross(camera.right, camera.forward);
  camera.orthographic = view.ortho_height.has_value();
  camera.half_height = view.ortho_height ? 0.5 * *view.ortho_height : halfSlope(view);
  camera.half_width = camera.half_height * view.width / view.height;
  return camera;
}

// Whatever is chosen here and not by the caller is never to blame.
void checkReach(const View& view, const glm::dvec3& eye, const WorldBox& box, const char* placed_by) {
  const double farthest = kFarthestDiagonals * glm::length(box.max - box.min);
  const double distance = glm::length(eye - 0.5 * (box.min + box.max));
  if (!(distance <= farthest)) {
    throw ViewError(placed_by, fmt::format("the eye is {} away from the volume, at most {} can be drawn right: {} of "
                                           "the volume's diagonal",
                                           distance, farthest, kFarthestDiagonals));
  }
  if (view.ortho_height && *view.ortho_height > farthest) {
    throw ViewError("ortho", fmt::format("{} is more than {}, {} of the volume's diagonal", *view.ortho_height,
                                         farthest, kFarthestDiagonals));
  }
}

void resolveCamera(const View& view, const VolumeInfo& info, ResolvedView& resolved) {
  const WorldBox framed = worldBox(info, nonemptyBox(info));
  resolved.target = view.target.value_or(0.5 * (framed.min + framed.max));
  const FirstLook look = firstLook(info.metadata.space);
  resolved.up = view.up.value_or(look.up);
  const glm::dvec3 up = framingUp(look, resolved.up);
  const glm::dvec3 eye = view.eye ? *view.eye : framingEye(view, framed, resolved.target, look.from, up);
  const char* placed_by = view.eye ? "eye" : view.target ? "target" : "fov";
  for (const auto& [value, field] : {std::pair{&eye, placed_by}, {&resolved.target, "target"}, {&resolved.up, "up"}}) {
    if (!isFinite(*value)) throw ViewError(field, "is not finite");
  }
  checkReach(view, eye, worldBox(info), placed_by);
  const glm::dvec3 toward = resolved.target - eye;
  const double distance = glm::length(toward);
  if (!(distance > 0) || !std::isfinite(distance))
    throw ViewError("target", "eye and target are the same point, or too far apart");
  const double up_length = glm::length(resolved.up);
  if (!(up_length > 0) || !std::isfinite(up_length)) throw ViewError("up", "has no direction");
  if (glm::length(glm::cross(toward / distance, resolved.up / up_length)) < 1e-9) {
    throw ViewError("up", "is parallel to the line of sight");
  }
  resolved.camera = cameraAt(view, eye, toward, resolved.up);
}

void checkTransfer(const std::vector<TransferPoint>& transfer) {
  for (std::size_t i = 0; i < transfer.size(); ++i) {
    const TransferPoint& point = transfer[i];
    if (!std::isfinite(point.value) || (i > 0 && point.value <= transfer[i - 1].value)) {
      throw ViewError("tf", fmt::format("point {}: values must be finite and ascend", i));
    }
    if (!(point.opacity >= 0 && point.opacity <= 1)) {
      throw ViewError("tf", fmt::format("point {}: opacity {} is not within 0..1", i, point.opacity));
    }
  }
}

void checkClip(const View& view) {
  for (int axis = 0; view.clip && axis < 3; ++axis) {
    const double lo = view.clip->min[axis];
    const double hi = view.clip->max[axis];
    if (!(lo <= hi) || !std::isfinite(lo) || !std::isfinite(hi)) {
      throw ViewError("clip", fmt::format("{}..{} along {} is not a lower and an upper bound", lo, hi, "xyz"[axis]));
    }
  }
  if (view.planes.size() > kMaxPlanes) {
    throw ViewError("planes", fmt::format("there are {}, at most {} may be", view.planes.size(), kMaxPlanes));
  }
  for (std::size_t i = 0; i < view.planes.size(); ++i) {
    if (!isFinite(view.planes[i].normal) || !std::isfinite(view.planes[i].offset)) {
      throw ViewError("planes", fmt::format("plane {} is not finite", i));
    }
    if (view.planes[i].normal == glm::dvec3(0)) {
      throw ViewError("planes", fmt::format("plane {} has no direction: its normal is 0", i));
    }
  }
}

void checkOutput(const ResolvedView& view) {
  if (view.samples < 1 || view.samples > kMaxSamples) {
    throw ViewError("samples", fmt::format("{} is not within 1..{}", view.samples, kMaxSamples));
  }
  if (view.output == Output::mesh && view.finder == Finder::none) {
    throw ViewError("output", "mesh: finder none looks in nothing that has edges; use another finder");
  }
  if (view.samples > 1 && !isPicture(view.output)) {
    throw ViewError("samples", fmt::format("{}: only colours are averaged; other outputs take 1", view.samples));
  }
  const bool needs_point = view.output == Output::depth || view.output == Output::position;
  if (needs_point && (view.mode == Mode::mean || view.mode == Mode::blocks)) {
    throw ViewError("output",
                    "depth and position are of a point, and this mode shows none: use blend, first-hit, iso, mip, "
                    "minip or attenuated-mip");
  }
  if (view.output == Output::value && view.mode == Mode::blocks) {
    throw ViewError("output", "value is of densities, and mode blocks counts blocks: use another mode");
  }
  if (view.output == Output::value && view.drawn.size() > 1) {
    throw ViewError("output", "value is one number a pixel, and several channels have several: draw one channel");
  }
  if (needs_point && showsExtreme(view.mode) && view.drawn.size() > 1) {
    throw ViewError("output",
                    "depth and position are of a point, and this mode shows one of each channel: draw one channel");
  }
}

// Between two labels lies none: a value between 2 and 10 would be the name of something else.
void checkFilter(const ResolvedView& view, const VolumeInfo& info) {
  if (view.filter != Filter::linear) return;
  for (const int number : view.drawn) {
    if (info.channels[static_cast<std::size_t>(number)].values != ChannelValues::labels) continue;
    throw ViewError("filter", fmt::format("linear: channel {} holds labels, which have no values between them; use "
                                          "nearest",
                                          number));
  }
}

// Which channels are drawn; in the volume's order, so that a view does not depend on how they are listed.
std::vector<int> resolveDrawn(const View& view, const VolumeInfo& info) {
  const auto count = static_cast<int>(info.channels.size());
  std::vector<int> drawn = view.drawn;
  if (drawn.empty()) {
    drawn.resize(info.channels.size());
    std::iota(drawn.begin(), drawn.end(), 0);
  }
  std::ranges::sort(drawn);
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    if (drawn[i] < 0 || drawn[i] >= count) {
      throw ViewError("channels", fmt::format("{} is not within 0..{}", drawn[i], count - 1));
    }
    if (i > 0 && drawn[i] == drawn[i - 1]) throw ViewError("channels", fmt::format("{} is given twice", drawn[i]));
  }
  return drawn;
}

ResolvedChannel resolveChannel(const ChannelView& look, const VolumeInfo& info, std::size_t number) {
  const ChannelInfo& channel = info.channels[number];
  ResolvedChannel resolved{
      .range = {.lo = channel.dataFromStored(channel.density_min), .hi = channel.dataFromStored(channel.density_max)},
      .transfer = look.transfer};
  if (look.range) resolved.range = *look.range;
  const DensityRange& range = resolved.range;
  if (!(range.lo <= range.hi) || !std::isfinite(range.lo) || !std::isfinite(range.hi)) {
    throw ViewError("range", fmt::format("{}:{} is not a lower and an upper bound", range.lo, range.hi));
  }
  if (info.type == VoxelType::rgba8) {
    if (!look.transfer.empty() || look.transfer_preset != TransferPreset::automatic) {
      throw ViewError("tf", "this volume has its own colours (rgba8); use extinction");
    }
  } else if (look.transfer.empty()) {
    resolved.transfer = presetTransfer(look.transfer_preset, info, number);
  }
  checkTransfer(resolved.transfer);
  return resolved;
}

void resolveChannels(const View& view, const VolumeInfo& info, ResolvedView& resolved) {
  resolved.drawn = resolveDrawn(view, info);
  for (std::size_t i = 0; i < info.channels.size(); ++i) {
    resolved.channels.push_back(resolveChannel(view.channels[i], info, i));
  }
  for (std::size_t i = info.channels.size(); i < view.channels.size(); ++i) {
    const auto refuse = [&](const char* field) {
      throw ViewError(field, fmt::format("is given for channel {}, the volume has {} from 0", i, info.channels.size()));
    };
    if (view.channels[i].range) refuse("range");
    if (!view.channels[i].transfer.empty() || view.channels[i].transfer_preset != TransferPreset::automatic) {
      refuse("tf");
    }
  }
}

}  // namespace

ResolvedView resolveView(const View& view, const VolumeInfo& info) {
  checkNumbers(view);
  checkMacrocell(view);
  checkLight(view);
  checkLens(view, worldBox(info));
  ResolvedView resolved;
  static_cast<ViewChoices&>(resolved) = view;
  resolveCamera(view, info, resolved);
  resolveChannels(view, info, resolved);
  const DensityRange& range = resolved.channels[static_cast<std::size_t>(resolved.drawn[0])].range;
  resolved.iso = view.iso.value_or(0.5 * (range.lo + range.hi));
  if (!std::isfinite(resolved.iso)) throw ViewError("iso", "is not finite");
  checkClip(view);
  checkFilter(resolved, info);
  checkOutput(resolved);
  const auto levels = static_cast<int>(info.levels.size());
  if (resolved.level != kAutoLevel && (resolved.level < 0 || resolved.level >= levels)) {
    throw ViewError("level", fmt::format("{} is not within 0..{}", resolved.level, levels - 1));
  }
  if (resolved.time < 0 || resolved.time >= info.steps) {
    throw ViewError("time", fmt::format("{} is not within 0..{}, the volume's steps", resolved.time, info.steps - 1));
  }
  return resolved;
}

View spellOut(const ResolvedView& resolved) {
  View view;
  static_cast<ViewChoices&>(view) = resolved;
  view.eye = resolved.camera.eye;
  view.target = resolved.target;
  view.up = resolved.up;
  if (resolved.camera.orthographic) view.ortho_height = 2 * resolved.camera.half_height;
  view.drawn = resolved.drawn;
  for (std::size_t i = 0; i < resolved.channels.size(); ++i) {
    view.channels[i].range = resolved.channels[i].range;
    view.channels[i].transfer = resolved.channels[i].transfer;
  }
  view.iso = resolved.iso;
  return view;
}

}  // namespace blockwalk
