// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/level_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "renderer/plan/plan.h"
#include "shaders/kernel_interface.h"

namespace blockwalk {
namespace {

// Voxels of level 0 that a pixel covers at a depth of 1 before the eye; orthographic: at any.
double footprintSlope(const ResolvedView& view, const VolumeInfo& info) {
  return 2 * view.camera.half_height / view.height / unitDistance(info);
}

struct Footprints {
  double nearest = 0;
  double farthest = 0;
};

// Of the corners of the volume's box; below 0 behind the eye.
Footprints footprintsOf(const ResolvedView& view, const VolumeInfo& info) {
  const Camera& camera = view.camera;
  const double slope = footprintSlope(view, info);
  if (camera.orthographic) return {.nearest = slope, .farthest = slope};
  Footprints footprints{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const glm::dvec3& corner : worldCorners(info)) {
    const double footprint = slope * glm::dot(corner - camera.eye, camera.forward);
    footprints.nearest = std::min(footprints.nearest, footprint);
    footprints.farthest = std::max(footprints.farthest, footprint);
  }
  return footprints;
}

bool drawsMaxima(const ResolvedView& view, const VolumeInfo& info) {
  return view.mode == Mode::mip && info.has(kFirstMaximaLevel, Form::maxima);
}

// Voxels of level 0 that a pixel covers, from which on a level is drawn: its voxels are no larger than a pixel. A
// maximum is lost between two rays, not thinned out: of those the level whose voxels are no smaller than one.
double leastFootprint(const ResolvedView& view, const VolumeInfo& info, int level) {
  if (!drawsMaxima(view, info)) return std::ldexp(1.0, level);
  if (level < kFirstMaximaLevel) return std::numeric_limits<double>::infinity();
  if (level == kFirstMaximaLevel) return 2;
  return std::nextafter(std::ldexp(1.0, level - 1), std::numeric_limits<double>::infinity());
}

// Of which a ray has less left where it goes on in a level: Reese 2019, 3.1, with `finest` the number of levels that
// are coarser than the one begun with, each of which is one of his.
double leastTransmittance(const ResolvedView& view, const VolumeInfo& info, int finest, int level) {
  const int coarser = static_cast<int>(info.levels.size()) - 1 - finest;
  if (view.lod_alpha == 0 || view.mode != Mode::blend) return 0;
  return std::max(0.0, 1 - (level - finest) / (view.lod_alpha * coarser));
}

// One density of a ray is never shown of means of intensities: of coarse levels there are none but the greatest.
bool isMeanOfIntensities(const ResolvedView& view, const VolumeInfo& info, int level) {
  const bool has_extremes = view.mode == Mode::mip && info.has(level, Form::maxima);
  return showsExtreme(view.mode) && level > 0 && !has_extremes && std::ranges::any_of(view.drawn, [&](int channel) {
           return info.channels[static_cast<std::size_t>(channel)].values != ChannelValues::labels;
         });
}

}  // namespace

int chooseLevel(const ResolvedView& view, const VolumeInfo& info) {
  const double footprint = footprintsOf(view, info).nearest;
  int level = static_cast<int>(info.levels.size()) - 1;
  while (level > 0 && !(footprint >= leastFootprint(view, info, level))) --level;
  return level;
}

int drawnLevel(const ResolvedView& view, const VolumeInfo& info, int finest) {
  const int level = view.level == kAutoLevel ? std::max(chooseLevel(view, info), finest) : view.level;
  return isMeanOfIntensities(view, info, level) ? 0 : level;
}

std::vector<FarLevel> farLevels(const ResolvedView& view, const VolumeInfo& info, int level) {
  std::vector<FarLevel> levels;
  const bool is_one = view.lod == kOneLevel || view.mode == Mode::blocks || hasSecondaryRays(view);
  if (view.level != kAutoLevel || is_one) return levels;
  const double farthest = footprintsOf(view, info).farthest;
  const int count = static_cast<int>(info.levels.size());
  for (int coarser = level + 1; coarser < count && levels.size() < gpu::kMaxFarLevels; ++coarser) {
    const double footprint = leastFootprint(view, info, coarser) * view.lod;
    if (isMeanOfIntensities(view, info, coarser) || std::isinf(footprint)) continue;
    const Form form = view.mode == Mode::mip && info.has(coarser, Form::maxima) ? Form::maxima : Form::values;
    const double transmittance = leastTransmittance(view, info, level, coarser);
    if (!(farthest > footprint || transmittance > 0) || info.level(coarser, form).block_count == 0) break;
    levels.push_back({.level = coarser,
                      .form = form,
                      .depth = view.camera.orthographic ? std::numeric_limits<double>::infinity()
                                                        : footprint / footprintSlope(view, info),
                      .transmittance = transmittance});
  }
  return levels;
}

}  // namespace blockwalk
