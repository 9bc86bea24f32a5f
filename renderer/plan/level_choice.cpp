// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/level_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace blockwalk {

int chooseLevel(const ResolvedView& view, const VolumeInfo& info) {
  const Camera& camera = view.camera;
  const double pixel_slope = 2 * camera.half_height / view.height;
  double pixel = pixel_slope;  // world size of a pixel
  if (!camera.orthographic) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const glm::dvec3& corner : worldCorners(info)) {
      nearest = std::min(nearest, glm::dot(corner - camera.eye, camera.forward));
    }
    pixel = pixel_slope * nearest;
  }
  const double voxels = pixel / unitDistance(info);
  if (!(voxels >= 2)) return 0;
  const auto last = static_cast<int>(info.levels.size()) - 1;
  if (view.mode == Mode::mip && info.has(kFirstMaximaLevel, Form::maxima)) {
    // A maximum is lost between two rays, not thinned out: the level whose voxels are no smaller than a pixel.
    const double level = std::max(std::ceil(std::log2(voxels)), static_cast<double>(kFirstMaximaLevel));
    return static_cast<int>(std::min(level, static_cast<double>(last)));
  }
  return static_cast<int>(std::min(std::floor(std::log2(voxels)), static_cast<double>(last)));
}

int drawnLevel(const ResolvedView& view, const VolumeInfo& info, int finest) {
  const int level = view.level == kAutoLevel ? std::max(chooseLevel(view, info), finest) : view.level;
  const bool means = view.mode == Mode::mip && level > 0 && !info.has(level, Form::maxima) &&
                     std::ranges::any_of(view.drawn, [&](int channel) {
                       return info.channels[static_cast<std::size_t>(channel)].values != ChannelValues::labels;
                     });
  return means ? 0 : level;
}

}  // namespace blockwalk
