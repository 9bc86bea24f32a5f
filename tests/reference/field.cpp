// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/field.h"

#include <algorithm>
#include <cmath>

namespace blockwalk::reference {
namespace {

// Exact where both are equal, and relatively so where one is 0: a colour is a ratio of two interpolations, however
// small.
glm::dvec4 lerp(const glm::dvec4& a, const glm::dvec4& b, double w) {
  glm::dvec4 result(a);
  for (int c = 0; c < 4; ++c) {
    if (a[c] != b[c]) result[c] = (1 - w) * a[c] + w * b[c];
  }
  return result;
}

using Polynomial = std::array<glm::dvec4, 4>;

// a + (b - a) (w + slope s), of one degree more.
Polynomial lerp(const Polynomial& a, const Polynomial& b, double w, double slope) {
  Polynomial result{};
  for (std::size_t i = 0; i < 4; ++i) {
    result[i] += lerp(a[i], b[i], w);
    if (i + 1 < 4) result[i + 1] += slope * (b[i] - a[i]);
  }
  return result;
}

}  // namespace

bool isEmpty(const DenseVolume& volume, float stored) {
  return !std::isfinite(stored) || stored <= volume.empty_threshold;
}

double emptyValue(const DenseVolume& volume) {
  if (volume.type == VoxelType::rgba8) return 0;
  const auto threshold = static_cast<double>(volume.empty_threshold);
  const double zero = -volume.value_offset / volume.value_scale;
  const double value = zero <= threshold ? zero : threshold;
  if (volume.type == VoxelType::f32) return static_cast<double>(static_cast<float>(value));
  return std::clamp(std::floor(value), 0.0, volume.type == VoxelType::u16 ? 65535.0 : 255.0);
}

glm::dvec4 voxelField(const DenseVolume& volume, glm::ivec3 voxel) {
  const std::size_t at = volume.at(glm::clamp(voxel, glm::ivec3(0), volume.dims - 1));
  if (isEmpty(volume, volume.density[at])) return {0, 0, 0, emptyValue(volume)};
  const auto density = static_cast<double>(volume.density[at]);
  if (volume.type != VoxelType::rgba8) return {0, 0, 0, density};
  const auto& c = volume.color[at];
  return {glm::dvec3(c[0], c[1], c[2]) / 255.0 * density, density};
}

Cell cellAround(const DenseVolume& volume, glm::dvec3 position) {
  Cell cell{.base = glm::floor(position - 0.5)};
  // Far outside, where a cell's index fits no integer, the nearest voxel inside is the same.
  const glm::ivec3 base(glm::clamp(cell.base, glm::dvec3(-2), glm::dvec3(volume.dims + 1)));
  for (int i = 0; i < 8; ++i) {
    cell.corners[static_cast<std::size_t>(i)] = voxelField(volume, base + glm::ivec3(i & 1, i >> 1 & 1, i >> 2));
  }
  return cell;
}

glm::dvec4 Cell::at(glm::dvec3 position) const {
  const glm::dvec3 w = position - 0.5 - base;
  const auto& c = corners;
  return lerp(lerp(lerp(c[0], c[1], w.x), lerp(c[2], c[3], w.x), w.y),
              lerp(lerp(c[4], c[5], w.x), lerp(c[6], c[7], w.x), w.y), w.z);
}

bool Cell::isFlat() const {
  return std::ranges::all_of(corners, [&](const glm::dvec4& corner) { return corner.w == corners[0].w; });
}

glm::dvec4 fieldAt(const DenseVolume& volume, glm::dvec3 position) { return cellAround(volume, position).at(position); }

glm::dvec3 gradientAt(const DenseVolume& volume, glm::dvec3 position, double reach) {
  glm::dvec3 gradient(0);
  for (int a = 0; a < 3; ++a) {
    glm::dvec3 offset(0);
    offset[a] = reach;
    gradient[a] = (fieldAt(volume, position + offset).w - fieldAt(volume, position - offset).w) / (2 * reach);
  }
  return gradient;
}

glm::dvec4 Cubic::at(double t) const {
  const double s = t - t_origin;
  return c[0] + s * (c[1] + s * (c[2] + s * c[3]));
}

double Cubic::slopeAt(double t) const {
  const double s = t - t_origin;
  return c[1].w + s * (2 * c[2].w + s * 3 * c[3].w);
}

Cubic cubicAlong(const Cell& cell, const Ray& index_ray, double t_origin) {
  const glm::dvec3 w = index_ray.at(t_origin) - 0.5 - cell.base;
  const glm::dvec3& d = index_ray.direction;
  std::array<Polynomial, 8> p{};
  for (std::size_t i = 0; i < 8; ++i) p[i][0] = cell.corners[i];
  for (std::size_t i = 0; i < 4; ++i) p[i] = lerp(p[2 * i], p[2 * i + 1], w.x, d.x);
  for (std::size_t i = 0; i < 2; ++i) p[i] = lerp(p[2 * i], p[2 * i + 1], w.y, d.y);
  return {.t_origin = t_origin, .c = lerp(p[0], p[1], w.z, d.z)};
}

}  // namespace blockwalk::reference
