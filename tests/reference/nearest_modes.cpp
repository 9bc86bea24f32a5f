// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <functional>

#include "tests/reference/classify.h"
#include "tests/reference/field.h"
#include "tests/reference/light.h"
#include "tests/reference/modes.h"

namespace blockwalk::reference {
namespace {

// How near the first cell is to being another one: along the ray from where it starts to the cell's face behind.
double startDistance(const Ray& ray, glm::ivec3 cell, double t_min) {
  double distance = std::numeric_limits<double>::infinity();
  for (int a = 0; a < 3; ++a) {
    if (ray.direction[a] == 0) continue;
    const double behind = (cell[a] + (ray.direction[a] > 0 ? 0 : 1) - ray.origin[a]) / ray.direction[a];
    distance = std::min(distance, std::abs(t_min - behind) * glm::length(ray.direction));
  }
  return distance;
}

double pieceDistance(const CutRay& cut, glm::ivec3 cell, Interval piece) {
  double distance = edgeDistance(cut.ray, glm::dvec3(cell), piece);
  distance = std::min(distance, (piece.t_max - piece.t_min) * glm::length(cut.ray.direction));
  if (cut.starts_inside && piece.t_min == cut.interval.t_min) {
    distance = std::min(distance, startDistance(cut.ray, cell, piece.t_min));
  }
  return distance;
}

bool isVoxelVisible(const Classifier& classifier, std::size_t voxel) {
  const float density = classifier.volume.density[voxel];
  return std::isfinite(density) && classifier.isVisible(static_cast<double>(density));
}

// Colour as stored, also where the density is 0 or less.
Material voxelMaterial(const Classifier& classifier, std::size_t voxel) {
  const DenseVolume& volume = classifier.volume;
  Material material = classifier.materialAt({0, 0, 0, static_cast<double>(volume.density[voxel])});
  if (volume.type == VoxelType::rgba8) {
    const auto& c = volume.color[voxel];
    material.color = glm::dvec3(c[0], c[1], c[2]) / 255.0;
  }
  return material;
}

glm::dvec3 shadedColor(const Scene& scene, const CutRay& cut, glm::ivec3 cell, glm::dvec3 color) {
  if (!scene.view.lit) return color;
  return shade(scene.volume, scene.view, cut.world, color, gradientAt(scene.volume, glm::dvec3(cell) + 0.5, 1));
}

// The range-mask bins that hold some density of the range.
unsigned binsOf(const DenseVolume& volume, const DensityRange& range) {
  double lo = (range.lo - volume.value_offset) / volume.value_scale;
  double hi = (range.hi - volume.value_offset) / volume.value_scale;
  if (lo > hi) std::swap(lo, hi);
  if (volume.type != VoxelType::f32) lo = std::ceil(lo);  // between two whole numbers there is no density
  unsigned bins = 0;
  for (int bin = volume.binOf(static_cast<float>(lo)); bin <= volume.binOf(static_cast<float>(hi)); ++bin)
    bins |= 1u << bin;
  return bins;
}

bool blockMeets(const DenseVolume& volume, const DensityRange& range, glm::ivec3 at) {
  const BlockRange& block = volume.blocks[volume.blockAt(at)];
  if (!block.stored) return false;
  // A value map of negative scale swaps the ends.
  const double end0 = volume.value_offset + volume.value_scale * static_cast<double>(block.density_min);
  const double end1 = volume.value_offset + volume.value_scale * static_cast<double>(block.density_max);
  const bool meets = std::max(end0, end1) >= range.lo && std::min(end0, end1) <= range.hi;
  return meets && (block.bins & binsOf(volume, range)) != 0;
}

}  // namespace

void nearestBlend(const Scene& scene, const CutRay& cut, Pixel& pixel) {
  const double unit = unitDistanceOf(scene.volume);
  const Classifier classifier(scene.volume, scene.view);
  double transmittance = 1;
  HalfOpacity half;
  glm::dvec3 light(0);
  walkCells(cut.ray, 1, cut.interval, [&](glm::ivec3 cell, Interval piece) {
    const std::size_t voxel = scene.volume.at(cell);
    if (!isVoxelVisible(classifier, voxel)) return true;
    const Material material = voxelMaterial(classifier, voxel);
    const double optical_depth = material.sigma * ((piece.t_max - piece.t_min) / unit);
    half.add(material.sigma / unit, piece, scene.volume.dataAt(voxel));
    light += transmittance * -std::expm1(-optical_depth) * shadedColor(scene, cut, cell, material.color);
    transmittance *= std::exp(-optical_depth);
    return true;
  });
  pixel.color = overBackground(scene.view, light, transmittance);
  half.show(pixel);
}

void nearestFirstHit(const Scene& scene, const CutRay& cut, Pixel& pixel) {
  const Classifier classifier(scene.volume, scene.view);
  pixel.edge_distance = cut.edge_distance;
  walkCells(cut.ray, 1, cut.interval, [&](glm::ivec3 cell, Interval piece) {
    pixel.edge_distance = std::min(pixel.edge_distance, pieceDistance(cut, cell, piece));
    const std::size_t voxel = scene.volume.at(cell);
    if (!isVoxelVisible(classifier, voxel)) return true;
    pixel.voxel = cell;
    pixel.t = piece.t_min;
    pixel.shows_point = true;
    pixel.value = scene.volume.dataAt(voxel);
    const glm::dvec3 color = shadedColor(scene, cut, cell, voxelMaterial(classifier, voxel).color);
    pixel.color = overBackground(scene.view, color, 0);
    return false;
  });
}

namespace {

// The voxel that comes before all others that are visible, of equal ones the first.
template <typename ComesBefore>
void nearestExtreme(const Scene& scene, const CutRay& cut, Pixel& pixel, ComesBefore comes_before) {
  const Classifier classifier(scene.volume, scene.view);
  pixel.edge_distance = cut.edge_distance;
  float extreme = 0;
  walkCells(cut.ray, 1, cut.interval, [&](glm::ivec3 cell, Interval piece) {
    pixel.edge_distance = std::min(pixel.edge_distance, pieceDistance(cut, cell, piece));
    const std::size_t voxel = scene.volume.at(cell);
    const float density = scene.volume.density[voxel];
    if (!isVoxelVisible(classifier, voxel) || (pixel.shows_point && !comes_before(density, extreme))) return true;
    extreme = density;
    pixel.voxel = cell;
    pixel.t = piece.t_min;
    pixel.shows_point = true;
    pixel.value = scene.volume.dataAt(voxel);
    pixel.color = overBackground(scene.view, voxelMaterial(classifier, voxel).color, 0);
    return true;
  });
}

}  // namespace

void nearestMip(const Scene& scene, const CutRay& cut, Pixel& pixel) {
  nearestExtreme(scene, cut, pixel, std::greater<>());
}

void nearestMinip(const Scene& scene, const CutRay& cut, Pixel& pixel) {
  nearestExtreme(scene, cut, pixel, std::less<>());
}

// A voxel counts where the ray enters it: in it, it is attenuated the least there.
void nearestAttenuatedMip(const Scene& scene, const CutRay& cut, Pixel& pixel) {
  const Classifier classifier(scene.volume, scene.view);
  pixel.edge_distance = cut.edge_distance;
  double largest = -1, passed = 0;
  walkCells(cut.ray, 1, cut.interval, [&](glm::ivec3 cell, Interval piece) {
    pixel.edge_distance = std::min(pixel.edge_distance, pieceDistance(cut, cell, piece));
    const std::size_t voxel = scene.volume.at(cell);
    if (!isVoxelVisible(classifier, voxel)) return true;
    const double share = classifier.shareOf(static_cast<double>(scene.volume.density[voxel]));
    const double attenuated = share * std::exp(-scene.view.attenuation * passed);
    passed += share * (piece.t_max - piece.t_min) / unitDistanceOf(scene.volume);
    if (!(attenuated > largest)) return true;
    largest = attenuated;
    pixel.voxel = cell;
    pixel.t = piece.t_min;
    pixel.shows_point = true;
    const double density = classifier.densityAt(attenuated);
    pixel.value = classifier.dataOf(density);
    const bool has_colors = scene.volume.type == VoxelType::rgba8;
    const Material material = has_colors ? voxelMaterial(classifier, voxel) : classifier.materialAt({0, 0, 0, density});
    pixel.color = overBackground(scene.view, material.color, 0);
    return true;
  });
}

void nearestMean(const Scene& scene, const CutRay& cut, Pixel& pixel) {
  const Classifier classifier(scene.volume, scene.view);
  double length = 0, sum = 0;
  glm::dvec3 product(0);
  walkCells(cut.ray, 1, cut.interval, [&](glm::ivec3 cell, Interval piece) {
    const std::size_t voxel = scene.volume.at(cell);
    if (!isVoxelVisible(classifier, voxel)) return true;
    const glm::dvec4 field = voxelField(scene.volume, cell);
    length += piece.t_max - piece.t_min;
    sum += field.w * (piece.t_max - piece.t_min);
    product += glm::dvec3(field) * (piece.t_max - piece.t_min);
    return true;
  });
  pixel.visible_length = length;
  if (!(length > 0)) return;
  const glm::dvec4 mean(product / length, sum / length);
  pixel.value = classifier.dataOf(mean.w);
  pixel.color = overBackground(scene.view, classifier.materialAt(mean).color, 0);
}

void countBlocks(std::span<const DenseVolume> channels, const View& view, const CutRay& cut, Pixel& pixel) {
  const int block_voxels = channels[0].block_voxels;
  const double side = block_voxels;
  CutRay coarse = cut;  // in units of a block, to measure distances
  coarse.ray.origin /= side;
  coarse.ray.direction /= side;
  double distance = cut.edge_distance / side;
  walkCells(cut.ray, block_voxels, cut.interval, [&](glm::ivec3 cell, Interval piece) {
    distance = std::min(distance, pieceDistance(coarse, cell, piece));
    const bool meets = std::ranges::any_of(
        channels, [&](const DenseVolume& volume) { return blockMeets(volume, Classifier(volume, view).range, cell); });
    pixel.blocks += meets ? 1 : 0;
    return true;
  });
  pixel.edge_distance = distance * side;
}

}  // namespace blockwalk::reference
