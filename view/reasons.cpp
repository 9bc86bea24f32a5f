// SPDX-License-Identifier: Apache-2.0
#include "view/reasons.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "view/frame.h"
#include "view/polytope.h"

namespace blockwalk {
namespace {

using Changes = std::vector<ViewChange>;

constexpr double kHalfStep = 0.5 / 255;  // of an 8-bit colour: less than that of opacity is not seen
constexpr double kFramedOrtho = 1.04;    // of the diagonal: what frames the volume from anywhere

Changes toAuto(std::initializer_list<const char*> members, const char* value = "auto") {
  Changes changes;
  for (const char* member : members) changes.push_back({.member = member, .value = std::string(value)});
  return changes;
}

Changes framedCamera(const ResolvedView& view, const VolumeInfo& info) {
  Changes changes = toAuto({"eye", "target", "up"});
  if (!view.camera.orthographic) return changes;
  const WorldBox box = worldBox(info, nonemptyBox(info));
  changes.push_back({.member = "ortho", .value = kFramedOrtho * glm::length(box.max - box.min)});
  return changes;
}

// The corners' extent in the picture, pixels; none where some lie behind the eye.
std::optional<glm::dvec2> extentOf(const ResolvedView& view, const VolumeInfo& info) {
  const Camera& camera = view.camera;
  glm::dvec2 least(std::numeric_limits<double>::infinity());
  glm::dvec2 most(-std::numeric_limits<double>::infinity());
  for (const glm::dvec3& corner : worldCorners(info)) {
    const glm::dvec3 offset = corner - camera.eye;
    const double depth = glm::dot(offset, camera.forward);
    if (!(depth > 0)) return {};
    const glm::dvec2 place = glm::dvec2(glm::dot(offset, camera.right), glm::dot(offset, camera.up)) /
                             glm::dvec2(camera.half_width, camera.half_height) / (camera.orthographic ? 1 : depth);
    least = glm::min(least, place);
    most = glm::max(most, place);
  }
  return 0.5 * (most - least) * glm::dvec2(view.width, view.height);
}

bool liesBehind(const Camera& camera, const VolumeInfo& info) {
  return std::ranges::all_of(
      worldCorners(info), [&](const glm::dvec3& corner) { return glm::dot(corner - camera.eye, camera.forward) <= 0; });
}

void explainPlace(const ResolvedView& view, const VolumeInfo& info, std::vector<Reason>& reasons) {
  const std::vector<ClipPlane> picture = picturePlanes(view.camera);
  const std::vector<ClipPlane> cuts = clipPlanes(view);
  const auto blameCamera = [&](const char* detail) {
    reasons.push_back({.name = "camera", .detail = detail, .change = framedCamera(view, info)});
  };
  const bool in_picture = leavesSome(info, {}, picture);
  const std::optional<glm::dvec2> extent = extentOf(view, info);
  if (liesBehind(view.camera, info)) {
    blameCamera("The eye looks away from the volume.");
  } else if (!in_picture) {
    blameCamera("The volume lies outside the picture.");
  } else if (extent && extent->x < 1 && extent->y < 1) {
    blameCamera("The volume is smaller than a pixel.");
  }
  if (cuts.empty()) return;
  std::vector<const char*> members;
  if (view.clip) members.push_back("clip");
  if (!view.planes.empty()) members.push_back("planes");
  const auto blameCuts = [&](const char* detail) {
    Reason reason{.name = "clip", .detail = detail, .change = {}};
    for (const char* member : members) reason.change.push_back({.member = member, .value = std::string("none")});
    reasons.push_back(std::move(reason));
  };
  if (!leavesSome(info, cuts)) {
    blameCuts("The clip box and planes leave nothing of the volume.");
  } else if (in_picture && !leavesSome(info, cuts, picture)) {
    blameCuts("What the clip box and planes leave of the volume lies outside the picture.");
  }
}

// Densities of the non-empty voxels, data units.
DensityRange densitiesOf(const ChannelInfo& channel) {
  return {.lo = channel.dataFromStored(channel.density_min), .hi = channel.dataFromStored(channel.density_max)};
}

bool isEmpty(const ChannelInfo& channel) { return channel.nonempty_voxels == 0; }

double opacityAt(const std::vector<TransferPoint>& points, TransferShape shape, double value) {
  const auto after = std::ranges::upper_bound(points, value, {}, &TransferPoint::value);
  if (after == points.begin()) return points.front().opacity;
  const TransferPoint& before = *std::prev(after);
  if (after == points.end() || shape == TransferShape::stepped) return before.opacity;
  const double share = (value - before.value) / (after->value - before.value);
  return before.opacity + share * (after->opacity - before.opacity);
}

// The greatest between two values, both ends included.
double mostOpacity(const ResolvedView& view, std::size_t number, const DensityRange& values) {
  const std::vector<TransferPoint>& points = view.channels[number].transfer;
  double most =
      std::max(opacityAt(points, view.transfer_shape, values.lo), opacityAt(points, view.transfer_shape, values.hi));
  for (const TransferPoint& point : points) {
    if (point.value >= values.lo && point.value <= values.hi) most = std::max(most, point.opacity);
  }
  return most;
}

// What so much opacity over the unit distance comes to over all of the volume.
double opacityThrough(const VolumeInfo& info, double extinction_of_unit) {
  const WorldBox box = worldBox(info);
  return -std::expm1(-extinction_of_unit * glm::length(box.max - box.min) / unitDistance(info));
}

bool isTransparent(const ResolvedView& view, const VolumeInfo& info, std::size_t number, const DensityRange& values) {
  const double opacity = mostOpacity(view, number, values);
  if (view.mode == Mode::first_hit || opacity >= 1) return !(opacity > 0);
  return opacityThrough(info, -std::log1p(-opacity)) < kHalfStep;
}

void explainIso(const ResolvedView& view, const VolumeInfo& info, std::vector<Reason>& reasons) {
  const auto first = static_cast<std::size_t>(view.drawn[0]);
  const DensityRange densities = densitiesOf(info.channels[first]);
  if (isEmpty(info.channels[first])) {
    Changes change;
    if (view.drawn.size() > 1) change = toAuto({"mode"}, "blend");
    reasons.push_back({.name = "channels",
                       .detail = fmt::format("No voxel of channel {}, whose surface is drawn, holds anything.", first),
                       .change = std::move(change)});
  } else if (view.iso > densities.hi) {
    const DensityRange& range = view.channels[first].range;
    const bool range_helps = 0.5 * (range.lo + range.hi) > densities.hi;
    reasons.push_back({.name = "iso",
                       .detail = fmt::format("No voxel is as dense as {}: densities are from {} to {}.", view.iso,
                                             densities.lo, densities.hi),
                       .change = range_helps ? toAuto({"iso", "range"}) : toAuto({"iso"})});
  }
}

struct Hidden {
  bool by_range = false;
  bool by_transfer = false;
};

Hidden hiddenBy(const ResolvedView& view, const VolumeInfo& info, std::size_t number) {
  const DensityRange densities = densitiesOf(info.channels[number]);
  const DensityRange& range = view.channels[number].range;
  DensityRange shown{.lo = std::max(range.lo, densities.lo), .hi = std::min(range.hi, densities.hi)};
  Hidden hidden{.by_range = shown.lo > shown.hi};
  if (hidden.by_range) shown = densities;  // what a range that shows all would have
  const bool has_transfer = info.type != VoxelType::rgba8 && (view.mode == Mode::blend || view.mode == Mode::first_hit);
  hidden.by_transfer = has_transfer && isTransparent(view, info, number, shown);
  return hidden;
}

void explainDensities(const ResolvedView& view, const VolumeInfo& info, std::vector<Reason>& reasons) {
  Hidden all;
  std::string ranges;
  for (const int channel : view.drawn) {
    const auto number = static_cast<std::size_t>(channel);
    if (isEmpty(info.channels[number])) continue;
    const Hidden hidden = hiddenBy(view, info, number);
    if (!hidden.by_range && !hidden.by_transfer) return;
    all = {.by_range = all.by_range || hidden.by_range, .by_transfer = all.by_transfer || hidden.by_transfer};
    const DensityRange densities = densitiesOf(info.channels[number]);
    const DensityRange& range = view.channels[number].range;
    if (hidden.by_range) {
      ranges += fmt::format("{}{}..{} shows none of {}..{}", ranges.empty() ? "" : "; ", range.lo, range.hi,
                            densities.lo, densities.hi);
    }
  }
  if (all.by_range) {
    reasons.push_back({.name = "range",
                       .detail = fmt::format("The range meets no density of the volume: {}.", ranges),
                       .change = toAuto({"range"})});
  }
  if (all.by_transfer) {
    reasons.push_back(
        {.name = "tf", .detail = "The transfer function is transparent over the range.", .change = toAuto({"tf"})});
  }
}

void explainExtinction(const ResolvedView& view, const VolumeInfo& info, std::vector<Reason>& reasons) {
  if (info.type != VoxelType::rgba8 || view.mode != Mode::blend) return;
  if (!(opacityThrough(info, view.extinction) < kHalfStep)) return;
  reasons.push_back({.name = "extinction",
                     .detail = fmt::format("An extinction of {} leaves even opaque voxels unseen.", view.extinction),
                     .change = {{.member = "extinction", .value = ViewChoices{}.extinction}}});
}

bool hasNothing(const ResolvedView& view, const VolumeInfo& info) {
  return std::ranges::all_of(view.drawn,
                             [&](int channel) { return isEmpty(info.channels[static_cast<std::size_t>(channel)]); });
}

Reason nothingStored(const VolumeInfo& info) {
  if (std::ranges::all_of(info.channels, isEmpty)) {
    return {.name = "channels", .detail = "The volume is empty: no voxel holds anything.", .change = {}};
  }
  return {.name = "channels",
          .detail = "No voxel of the channels that are drawn holds anything.",
          .change = toAuto({"channels"}, "all")};
}

// What a frame knows of its level.
void explainLevel(const ResolvedView& view, const RenderStats& stats, std::vector<Reason>& reasons) {
  if (stats.isComplete()) return;
  if (stats.as_it_is && !stats.is_coarser && stats.page_failure.empty()) {
    reasons.push_back(
        {.name = "loading",
         .detail = fmt::format("Voxels of {} blocks are still read; until then they are coarser.", stats.absent_blocks),
         .change = {}});
    return;
  }
  Reason reason{.name = "level", .detail = {}, .change = {}};
  if (!stats.page_failure.empty()) {
    reason.detail = fmt::format("Voxels could not be read: {}.", stats.page_failure);
  } else {
    const std::string bytes = stats.needed_bytes == 0 ? ""
                                                      : fmt::format(": {} bytes are needed, {} are there",
                                                                    stats.needed_bytes, stats.room_bytes);
    reason.detail = fmt::format("Device memory is too small for the level that was asked for{}.", bytes);
    const bool has_apron = view.filter == Filter::linear;
    if (has_apron && isPicture(view.output) && !view.lit) reason.change = toAuto({"filter"}, "nearest");
  }
  reasons.push_back(std::move(reason));
}

// A coarse level may have lost all that is thin.
bool isLostToLevel(const VolumeInfo& info, const ResolvedView& view, int level) {
  return level > 0 && view.mode != Mode::mip && info.level(level, Form::values).block_count == 0 &&
         info.level(0, Form::values).block_count > 0;
}

}  // namespace

std::vector<Reason> reasonsForNothing(const ResolvedView& view, const VolumeInfo& info) {
  std::vector<Reason> reasons;
  if (hasNothing(view, info)) return {nothingStored(info)};
  explainPlace(view, info, reasons);
  if (view.mode == Mode::iso) {
    explainIso(view, info, reasons);
  } else {
    explainDensities(view, info, reasons);
  }
  explainExtinction(view, info, reasons);
  return reasons;
}

std::vector<Reason> reasonsOf(const ResolvedView& view, const VolumeInfo& info, const RenderStats& stats) {
  std::vector<Reason> reasons;
  if (stats.drawn_pixels == 0) {
    reasons = reasonsForNothing(view, info);
    if (isLostToLevel(info, view, stats.level)) {
      reasons.push_back({.name = "level",
                         .detail = fmt::format("Nothing is left of the volume on level {}.", stats.level),
                         .change = {{.member = "level", .value = 0.0}}});
    }
  }
  explainLevel(view, stats, reasons);
  if (stats.drawn_pixels == 0 && reasons.empty()) {
    reasons.push_back({.name = "unseen",
                       .detail = "What is there is hidden, lies between the rays, or has the background's colour.",
                       .change = framedCamera(view, info)});
  }
  return reasons;
}

}  // namespace blockwalk
