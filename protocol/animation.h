// SPDX-License-Identifier: Apache-2.0
// Views in time: a turntable, or a way from key to key. Which view each frame of it has; nothing is drawn here.
//
// Between two keys the target moves in a straight line. The eye and up turn about it together, as one, about one axis
// and at an even speed (Shoemake 1985, spherical linear interpolation of quaternions), half a turn counterclockwise
// about the first key's up; so up never comes to lie along the line of sight. The eye's distance changes by even
// factors, and so does an orthographic height. Other numbers change evenly: fov, the ranges, iso, extinction, step, the
// clip box where both have one, and the points of transfer functions where both have as many. Whatever else a view has
// is the earlier key's.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "protocol/view_fields.h"
#include "view/resolved_view.h"

namespace blockwalk {

constexpr int kMostAnimationFrames = 3600;
constexpr std::size_t kMostAnimationKeys = 256;

struct AnimationKey {
  double seconds = 0;
  View view = {};
};

// The first key's view, turned about an axis through its target.
struct Turntable {
  std::optional<glm::dvec3> axis = std::nullopt;  // world; else the view's up
  double degrees = 360;                           // seen from the axis' end, counterclockwise
  double seconds = 8;
};

struct Animation {
  std::vector<AnimationKey> keys;  // at least one; seconds ascend
  std::optional<Turntable> turntable;
  double fps = 25;
};

// {"fps": 25, "keys": [{"seconds": 0, "view": {...}}, ...]} or {"fps": 25, "view": {...}, "turntable": {"axis":
// [0,1,0], "degrees": 360, "seconds": 8}}, where all of turntable may be left out. "frames": 200 says how many there
// are in place of fps; "size" is that of all views. Throws ViewError naming the member and the bound.
// `others` names members that are not the animation's.
Animation readAnimation(const nlohmann::json& object, std::span<const std::string_view> others = {});

class Film {
 public:
  // Throws ViewError for views that the volume has not or that are no pictures, and for more frames than
  // kMostAnimationFrames.
  Film(const Animation& animation, const VolumeInfo& info);

  // A turntable has a frame for each part of its turn, and the next turn goes on from the last; keys have one at both
  // ends.
  int frames() const { return frames_; }
  double fps() const { return fps_; }
  int samples() const;  // of a pixel, the most of all keys
  // 0 .. frames() - 1, with every choice made.
  View view(int frame) const;

 private:
  View turned(double share) const;

  std::vector<double> seconds_;  // of the keys
  std::vector<View> views_;      // theirs, spelled out
  std::optional<Turntable> turntable_;
  double fps_;
  int frames_ = 1;
};

}  // namespace blockwalk
