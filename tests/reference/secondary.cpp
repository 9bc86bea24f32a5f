// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/secondary.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace blockwalk::reference {
namespace {

using Word = std::uint32_t;

constexpr int kDirections = 8;
constexpr double kSamePoint = 0.05;  // voxels

double shareOfWord(Word word) { return std::ldexp(word, -32); }

// A unit vector of the world, the same for all pixels.
glm::dvec3 directionAround(int index) {
  const Word number = static_cast<Word>(index) + 1;
  const Word a = Word{3242174889} * number + Word{2147483648};
  const Word b = Word{2447445414} * number + Word{2147483648};
  const double axis = 1 - 2 * shareOfWord(a);
  const double across = std::sqrt(1 - axis * axis);
  const double turn = 2 * std::numbers::pi * shareOfWord(b);
  return {across * std::cos(turn), across * std::sin(turn), axis};
}

glm::dvec3 directionToKeyLight(const View& view) {
  const glm::dvec3 forward = glm::normalize(view.target.value() - view.eye.value());
  const glm::dvec3 right = glm::normalize(glm::cross(forward, view.up.value()));
  const glm::dvec3 up = glm::cross(right, forward);
  return glm::normalize(view.key_light.x * right + view.key_light.y * up - view.key_light.z * forward);
}

}  // namespace

View withLightThatComes(const Scene& scene, const CutRay& cut, int sample, Pixel& pixel) {
  View unlit = scene.view;
  unlit.lit = false;
  unlit.background = {0, 0, 0, 0};
  const Scene bare{.volume = scene.volume, .view = unlit};
  const auto opacityAlong = [&](const CutRay& ray, Pixel& seen) {
    seen.color = glm::dvec4(0);
    renderAlong(bare, ray, seen);
    pixel.edge_distance = std::min(pixel.edge_distance, seen.edge_distance);
    pixel.lattice_distance = std::min(pixel.lattice_distance, seen.lattice_distance);
    pixel.margin = std::min(pixel.margin, seen.margin);
    return seen.color.a;
  };
  Pixel shown;
  const double opacity = opacityAlong(cut, shown);
  // Where the half is reached just before a gap, or just not, rays start on one side of it or the other.
  const double apart = (shown.t_late - shown.t_early) * glm::length(cut.ray.direction);
  if (scene.view.mode == Mode::blend && shown.t_early < shown.t_late && !(apart < kSamePoint)) pixel.margin = 0;
  if (!shown.shows_point) return scene.view;
  const double weight = scene.view.mode == Mode::blend ? std::clamp(4 * opacity - 2, 0.0, 1.0) : 1.0;
  const glm::dvec3 from = cut.world.at(shown.t);
  const auto coming = [&](glm::dvec3 direction, double reach) {
    CutRay ray = cutWorldRay(scene.volume, scene.view, {.origin = from, .direction = direction});
    const glm::dvec3 steps = glm::abs(ray.ray.direction);
    ray.interval.t_min = std::max(ray.interval.t_min, 1.5 / std::max({steps.x, steps.y, steps.z}));
    ray.interval.t_max = std::min(ray.interval.t_max, reach);
    ray.lattice_zero = 0;
    if (!(ray.interval.t_max > ray.interval.t_min)) return 1.0;
    // What hardly enters a voxel lies near a face wherever it goes.
    const double voxels = (ray.interval.t_max - ray.interval.t_min) * glm::length(ray.ray.direction);
    if (voxels > 1) pixel.face_distance = std::min(pixel.face_distance, faceDistance(ray));
    Pixel seen;
    return 1 - opacityAlong(ray, seen);
  };
  View left = scene.view;
  if (scene.view.shadow) {
    const double share = coming(directionToKeyLight(scene.view), std::numeric_limits<double>::infinity());
    left.lights.key *= 1 - weight * (1 - share);
  }
  if (scene.view.occlusion > 0) {
    double share = 0;
    for (int i = 0; i < kDirections; ++i) {
      const double reach = scene.view.occlusion * unitDistanceOf(scene.volume);
      share += coming(directionAround(sample * kDirections + i), reach) / kDirections;
    }
    left.lights.ambient *= 1 - weight * (1 - std::min(2 * share, 1.0));
  }
  return left;
}

glm::dvec2 placeOnLens(int x, int y, int sample) {
  // The seed of another pixel, and another sequence: the fractional parts of multiples of the roots of 2 and 3.
  const glm::dvec2 seed = placeOfSample(x + 40503, y + 30011, 0);
  const double u = seed.x + shareOfWord(static_cast<Word>(sample) * Word{1779033703});
  const double v = seed.y + shareOfWord(static_cast<Word>(sample) * Word{3144134277});
  const double turn = 2 * std::numbers::pi * (v - std::floor(v));
  return std::sqrt(u - std::floor(u)) * glm::dvec2(std::cos(turn), std::sin(turn));
}

}  // namespace blockwalk::reference
