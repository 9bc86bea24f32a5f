// SPDX-License-Identifier: Apache-2.0
#include "protocol/animation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/quaternion.hpp>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

#include "protocol/view_values.h"

namespace blockwalk {
namespace {

constexpr double kLeastFps = 0.1;
constexpr double kMostFps = 120;
constexpr double kMostSeconds = 3600;
constexpr double kMostDegrees = 36000;

double numberIn(const nlohmann::json& object, const char* name, double absent, double lo, double hi) {
  const auto found = object.find(name);
  if (found == object.end()) return absent;
  if (!found->is_number()) failName(name, "must be a number");
  const double value = found->get<double>();
  if (!(value >= lo && value <= hi)) failName(name, fmt::format("must be from {} to {}, not {}", lo, hi, value));
  return value;
}

constexpr std::array<std::string_view, 6> kMembers = {"fps", "frames", "size", "keys", "view", "turntable"};

void refuseOthers(const nlohmann::json& object, std::span<const std::string_view> known, std::string_view what) {
  if (!object.is_object()) failName(what, "must be an object");
  for (const auto& [name, value] : object.items()) {
    if (std::ranges::find(known, name) == known.end()) failName(name, fmt::format("is no member of {}", what));
  }
}

void requirePicture(const View& view) {
  if (!isPicture(view.output)) failName("output", "an animation is of pictures: color or mesh");
}

// What an animation says of all its views, `size`; or nothing.
std::optional<ImageRequest> imageOfAll(const nlohmann::json& animation, std::span<const std::string_view> others) {
  if (!animation.contains("size")) return {};
  ImageRequest image;
  std::vector<std::string_view> rest(others.begin(), others.end());
  std::ranges::remove_copy(kMembers, std::back_inserter(rest), "size");
  setViewFields(image, animation, rest);
  return image;
}

View viewIn(const nlohmann::json& object, const std::optional<ImageRequest>& of_all) {
  ImageRequest image = of_all.value_or(ImageRequest{});
  if (const auto found = object.find("view"); found != object.end()) {
    if (found->is_object()) {
      for (const char* name : {"format", "quality"}) {
        if (found->contains(name)) failName(name, "is of the animation, not of a view");
      }
      if (of_all && found->contains("size")) failName("size", "is given twice: for all, and in a view");
    }
    setViewFields(image, *found);
  }
  requirePicture(image.view);
  return image.view;
}

Turntable readTurntable(const nlohmann::json& object) {
  refuseOthers(object, std::array<std::string_view, 3>{"axis", "degrees", "seconds"}, "turntable");
  Turntable turntable;
  turntable.degrees = numberIn(object, "degrees", turntable.degrees, -kMostDegrees, kMostDegrees);
  turntable.seconds = numberIn(object, "seconds", turntable.seconds, 1e-3, kMostSeconds);
  if (const auto axis = object.find("axis"); axis != object.end()) {
    const bool is_vector = axis->is_array() && axis->size() == 3 &&
                           std::ranges::all_of(*axis, [](const auto& part) { return part.is_number(); });
    if (!is_vector) failName("axis", "must be three numbers");
    turntable.axis = glm::dvec3((*axis)[0].get<double>(), (*axis)[1].get<double>(), (*axis)[2].get<double>());
    const double length = glm::length(*turntable.axis);
    if (!(length > 0) || !std::isfinite(length)) failName("axis", "has no direction");
  }
  return turntable;
}

std::vector<AnimationKey> readKeys(const nlohmann::json& list, const std::optional<ImageRequest>& of_all) {
  if (!list.is_array() || list.empty() || list.size() > kMostAnimationKeys) {
    failName("keys", fmt::format("must be a list of 1 to {} keys", kMostAnimationKeys));
  }
  std::vector<AnimationKey> keys;
  for (const nlohmann::json& object : list) {
    refuseOthers(object, std::array<std::string_view, 2>{"seconds", "view"}, "a key");
    if (!object.contains("seconds")) failName("seconds", "is missing: when a key's view is shown");
    const double seconds = numberIn(object, "seconds", 0, 0, kMostSeconds);
    if (!keys.empty() && !(seconds > keys.back().seconds)) failName("seconds", "must ascend from key to key");
    keys.push_back({.seconds = seconds, .view = viewIn(object, of_all)});
  }
  return keys;
}

double mixed(double a, double b, double share) { return a + share * (b - a); }
double mixedFactor(double a, double b, double share) { return a * std::pow(b / a, share); }

// About a unit axis, counterclockwise (Rodrigues).
glm::dvec3 turnedAbout(const glm::dvec3& axis, const glm::dvec3& v, double angle) {
  return std::cos(angle) * v + std::sin(angle) * glm::cross(axis, v) + (1 - std::cos(angle)) * glm::dot(axis, v) * axis;
}

// Where an eye is, from the target, and what is up: of unit length and perpendicular to each other.
struct Heading {
  glm::dvec3 back{0};
  glm::dvec3 up{0};
};

Heading headingOf(const View& view) {
  const glm::dvec3 back = glm::normalize(*view.eye - *view.target);
  return {.back = back, .up = glm::normalize(*view.up - glm::dot(*view.up, back) * back)};
}

glm::dmat3 basisOf(const Heading& heading) { return {glm::cross(heading.up, heading.back), heading.up, heading.back}; }

// A part of the one turn that takes all of `a` to `b`, so that they stay perpendicular. Half a turn is counterclockwise
// about the first's up, as far as it can be told.
Heading mixedHeading(const Heading& a, const Heading& b, double share) {
  glm::dquat turn = glm::quat_cast(basisOf(b) * glm::transpose(basisOf(a)));
  glm::dvec3 axis(turn.x, turn.y, turn.z);
  const double sine = glm::length(axis);
  if (sine < 1e-12) return a;
  const bool is_half = std::abs(turn.w) < 1e-9;
  if (is_half ? glm::dot(axis, a.up) < 0 : turn.w < 0) {
    axis = -axis;
    turn.w = -turn.w;
  }
  const double angle = 2 * std::atan2(sine, turn.w);
  axis /= sine;
  return {.back = turnedAbout(axis, a.back, share * angle), .up = turnedAbout(axis, a.up, share * angle)};
}

void mixChannel(ChannelView& look, const ChannelView& next, double share) {
  look.range->lo = mixed(look.range->lo, next.range->lo, share);
  look.range->hi = mixed(look.range->hi, next.range->hi, share);
  if (look.transfer.size() != next.transfer.size()) return;
  for (std::size_t i = 0; i < look.transfer.size(); ++i) {
    TransferPoint& point = look.transfer[i];
    point.value = mixed(point.value, next.transfer[i].value, share);
    point.color += share * (next.transfer[i].color - point.color);
    point.opacity = mixed(point.opacity, next.transfer[i].opacity, share);
  }
}

// Both are spelled out.
View between(const View& a, const View& b, double share) {
  View view = a;
  const glm::dvec3 from = *a.eye - *a.target;
  const glm::dvec3 to = *b.eye - *b.target;
  const Heading heading = mixedHeading(headingOf(a), headingOf(b), share);
  view.target = *a.target + share * (*b.target - *a.target);
  view.eye = *view.target + mixedFactor(glm::length(from), glm::length(to), share) * heading.back;
  view.up = heading.up;
  if (a.ortho_height && b.ortho_height) {
    view.ortho_height = mixedFactor(*a.ortho_height, *b.ortho_height, share);
  } else if (!a.ortho_height && !b.ortho_height) {
    view.fov_degrees = mixed(a.fov_degrees, b.fov_degrees, share);
  }
  for (std::size_t i = 0; i < view.channels.size(); ++i) {
    if (a.channels[i].range && b.channels[i].range) mixChannel(view.channels[i], b.channels[i], share);
  }
  if (a.iso && b.iso) view.iso = mixed(*a.iso, *b.iso, share);
  view.extinction = mixed(a.extinction, b.extinction, share);
  view.step = mixed(a.step, b.step, share);
  if (a.clip && b.clip) {
    view.clip->min = a.clip->min + share * (b.clip->min - a.clip->min);
    view.clip->max = a.clip->max + share * (b.clip->max - a.clip->max);
  }
  return view;
}

// `frames` says how many there are, in place of how fast they follow each other.
void readFrames(const nlohmann::json& object, Animation& animation) {
  animation.fps = numberIn(object, "fps", animation.fps, kLeastFps, kMostFps);
  if (!object.contains("frames")) return;
  if (object.contains("fps")) failName("frames", "excludes fps: give one of both");
  const double frames = numberIn(object, "frames", 1, 1, kMostAnimationFrames);
  if (frames != std::floor(frames)) failName("frames", "must be a whole number");
  const double seconds = animation.turntable ? animation.turntable->seconds
                                             : animation.keys.back().seconds - animation.keys.front().seconds;
  const double steps = animation.turntable ? frames : frames - 1;
  if (!animation.turntable && (frames > 1) != (seconds > 0)) {
    failName("frames", "must be 1 of one key, and more of several");
  }
  if (seconds > 0) animation.fps = steps / seconds;
  if (!(animation.fps >= kLeastFps && animation.fps <= kMostFps)) {
    failName("frames", fmt::format("{} in {} seconds are {} a second, which must be from {} to {}", frames, seconds,
                                   animation.fps, kLeastFps, kMostFps));
  }
}

}  // namespace

Animation readAnimation(const nlohmann::json& object, std::span<const std::string_view> others) {
  std::vector<std::string_view> known(others.begin(), others.end());
  known.insert(known.end(), kMembers.begin(), kMembers.end());
  refuseOthers(object, known, "an animation");
  Animation animation;
  const std::optional<ImageRequest> of_all = imageOfAll(object, others);
  if (const auto keys = object.find("keys"); keys != object.end()) {
    for (const char* other : {"view", "turntable"}) {
      if (object.contains(other)) failName(other, "excludes keys: give one of both");
    }
    animation.keys = readKeys(*keys, of_all);
    readFrames(object, animation);
    return animation;
  }
  animation.keys.push_back({.seconds = 0, .view = viewIn(object, of_all)});
  const auto turntable = object.find("turntable");
  animation.turntable = turntable == object.end() ? Turntable{} : readTurntable(*turntable);
  readFrames(object, animation);
  return animation;
}

Film::Film(const Animation& animation, const VolumeInfo& info) : turntable_(animation.turntable), fps_(animation.fps) {
  for (const AnimationKey& key : animation.keys) {
    requirePicture(key.view);
    const View& first = animation.keys.front().view;
    if (key.view.width != first.width || key.view.height != first.height) {
      throw ViewError("size", "must be the same in all keys");
    }
    views_.push_back(spellOut(resolveView(key.view, info)));
    seconds_.push_back(key.seconds);
  }
  const double seconds = turntable_ ? turntable_->seconds : seconds_.back() - seconds_.front();
  const double frames = std::round(seconds * fps_) + (turntable_ ? 0 : 1);
  if (frames > kMostAnimationFrames) {
    throw ViewError("fps",
                    fmt::format("{} a second are {} frames, at most {} may be", fps_, frames, kMostAnimationFrames));
  }
  frames_ = std::max(1, static_cast<int>(frames));
}

int Film::samples() const { return std::ranges::max_element(views_, {}, &View::samples)->samples; }

View Film::turned(double share) const {
  View view = views_.front();
  const glm::dvec3 axis = glm::normalize(turntable_->axis.value_or(*view.up));
  const double angle = glm::radians(share * turntable_->degrees);
  view.eye = *view.target + turnedAbout(axis, *view.eye - *view.target, angle);
  view.up = turnedAbout(axis, *view.up, angle);
  return view;
}

View Film::view(int frame) const {
  if (turntable_) return turned(static_cast<double>(frame) / frames_);
  const double now = std::min(seconds_.front() + frame / fps_, seconds_.back());
  std::size_t key = 0;
  while (key + 2 < seconds_.size() && seconds_[key + 1] <= now) ++key;
  if (key + 1 >= seconds_.size()) return views_.back();
  const double share = (now - seconds_[key]) / (seconds_[key + 1] - seconds_[key]);
  return share <= 0 ? views_[key] : share >= 1 ? views_[key + 1] : between(views_[key], views_[key + 1], share);
}

}  // namespace blockwalk
