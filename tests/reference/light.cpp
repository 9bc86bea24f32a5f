// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/light.h"

#include <algorithm>
#include <cmath>

#include "tests/reference/modes.h"

namespace blockwalk::reference {

glm::dvec3 shade(const DenseVolume& volume, const View& view, const Ray& world_ray, glm::dvec3 color,
                 glm::dvec3 gradient_index) {
  if (gradient_index == glm::dvec3(0)) return color;
  const glm::dmat3 world_from_index(volume.world_from_index);
  const glm::dvec3 gradient = glm::transpose(glm::inverse(world_from_index)) * gradient_index;
  const glm::dvec3 n = glm::normalize(gradient);
  const double steepness = glm::length(gradient) * std::ldexp(1.0, -volume.level);
  const double strength = std::min(1.0, 500 * steepness * unitDistanceOf(volume) / volume.contrast);
  const glm::dvec3 v = -world_ray.direction;
  const glm::dvec3 forward = glm::normalize(view.target.value() - view.eye.value());
  const glm::dvec3 right = glm::normalize(glm::cross(forward, view.up.value()));
  const glm::dvec3 k = view.key_light;
  const glm::dvec3 l = glm::normalize(k.x * right + k.y * glm::cross(right, forward) - k.z * forward);
  const double head_on = std::abs(glm::dot(n, v));
  const Lights& lights = view.lights;
  const double factor = lights.ambient + lights.head * head_on + lights.key * std::abs(glm::dot(n, l));
  const glm::dvec3 lit = factor * color + lights.highlight * std::pow(head_on, 32);
  return color + strength * (lit - color);
}

}  // namespace blockwalk::reference
