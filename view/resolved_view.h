// SPDX-License-Identifier: Apache-2.0
// A view with every choice made for one volume, checked: what the renderer draws. Made once, where a request comes in.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "view/view.h"

namespace blockwalk {

// An orthonormal camera in world space. right, up and forward are unit vectors; right-handed: forward = up x right,
// that is -z looks forward when right is +x and up is +y.
struct Camera {
  glm::dvec3 eye{0};
  glm::dvec3 right{1, 0, 0};
  glm::dvec3 up{0, 1, 0};
  glm::dvec3 forward{0, 0, -1};
  bool orthographic = false;
  double half_height = 0;  // perspective: tan(fov / 2); orthographic: half the world height
  double half_width = 0;
  bool operator==(const Camera&) const = default;
};

// How one channel is drawn.
struct ResolvedChannel {
  DensityRange range;
  std::vector<TransferPoint> transfer;  // of scalars; values ascend
  bool operator==(const ResolvedChannel&) const = default;
};

struct ResolvedView : ViewChoices {
  Camera camera;
  // What the camera was made of, beside its eye; world.
  glm::dvec3 target{0};
  glm::dvec3 up{0, 1, 0};
  std::vector<int> drawn;                 // channels of the volume, at least one, ascending
  std::vector<ResolvedChannel> channels;  // every one of the volume, drawn or not
  double iso = 0;                         // data units
  bool operator==(const ResolvedView&) const = default;
};

// Chooses what the view leaves out. Throws ViewError where the view is undefined for this volume: eye = target, an eye
// too far away to tell places in the volume apart, up parallel to the view, a channel that is not there, a range
// inverted, a transfer function for rgba8, a level that is not there, a clip box inverted, a plane without a direction,
// the depth of a mode that shows no point, the value of several channels, several samples of what is no colour.
ResolvedView resolveView(const View& view, const VolumeInfo& info);

// The view that says all that was chosen: resolving it for the same volume gives the same again.
View spellOut(const ResolvedView& view);

}  // namespace blockwalk
