// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/reference.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

#include "tests/reference/ray.h"

namespace blockwalk::reference {
namespace {

double unitDistanceOf(const DenseVolume& volume) {
  const glm::dmat3 axes(volume.world_from_index);
  return std::min({glm::length(axes[0]), glm::length(axes[1]), glm::length(axes[2])});
}

// The view's range without those ends that exclude no voxel of level 0.
DensityRange openedRange(const DenseVolume& volume, DensityRange range) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (volume.level0_extent && range.lo <= volume.level0_extent->min) range.lo = -kInfinity;
  if (volume.level0_extent && range.hi >= volume.level0_extent->max) range.hi = kInfinity;
  return range;
}

bool isVisible(const DenseVolume& volume, const DensityRange& range, std::size_t voxel) {
  const float density = volume.density[voxel];
  if (!std::isfinite(density) || density <= volume.empty_threshold) return false;
  const double data = volume.dataAt(voxel);
  return data >= range.lo && data <= range.hi;
}

struct Material {
  glm::dvec3 color{0};
  double sigma = 0;  // per unit distance
};

Material materialAt(const DenseVolume& volume, const View& view, std::size_t voxel) {
  if (volume.type == VoxelType::rgba8) {
    const auto& c = volume.color[voxel];
    return {.color = glm::dvec3(c[0], c[1], c[2]) / 255.0,
            .sigma = view.extinction * static_cast<double>(volume.density[voxel]) / 255};
  }
  const TransferPoint point = transferAt(view.transfer, volume.dataAt(voxel));
  return {.color = point.color, .sigma = -std::log1p(-point.opacity)};
}

// Straight colour of `premultiplied` light seen with `transmittance` left, over the view's background.
glm::dvec4 overBackground(const View& view, glm::dvec3 premultiplied, double transmittance) {
  const glm::dvec4 background =
      glm::dvec4(view.background[0], view.background[1], view.background[2], view.background[3]) / 255.0;
  const double opacity = 1 - transmittance + transmittance * background.a;
  if (opacity <= 0) return glm::dvec4(0);
  return {(premultiplied + transmittance * background.a * glm::dvec3(background)) / opacity, opacity};
}

// A ray in the index space of one level and the part of it that the volume and the clip box leave.
struct CutRay {
  Ray ray;
  Interval interval;
  double edge_distance = 0;    // to the edges of the boxes, in voxels
  bool starts_inside = false;  // at the eye or at a clip face, not at a face of the volume
};

CutRay cutRay(const DenseVolume& volume, const View& view, int x, int y) {
  const Ray world = worldRay(view, x, y);
  CutRay cut{.ray = indexRay(volume, world),
             .interval = {.t_min = 0, .t_max = std::numeric_limits<double>::infinity()}};
  const glm::dvec3 box = glm::dvec3(volume.level0_dims) * std::ldexp(1.0, -volume.level);
  cut.interval = cutToBox(cut.ray, glm::dvec3(0), box, cut.interval);
  cut.edge_distance = boxEdgeDistance(cut.ray, glm::dvec3(0), box);
  cut.starts_inside = cut.interval.t_min == 0;
  if (view.clip) {
    const Interval clipped = cutToBox(world, view.clip->min, view.clip->max, cut.interval);
    cut.starts_inside = cut.starts_inside || clipped.t_min > cut.interval.t_min;
    cut.interval = clipped;
  }
  const double gap = std::abs(cut.interval.t_max - cut.interval.t_min) * glm::length(cut.ray.direction);
  cut.edge_distance = std::min(cut.edge_distance, gap);
  return cut;
}

double faceDistance(const CutRay& cut) {
  double distance = std::numeric_limits<double>::infinity();
  if (!(cut.interval.t_max > cut.interval.t_min)) return distance;
  const glm::dvec3 p = cut.ray.at(cut.interval.t_min);
  const glm::dvec3 q = cut.ray.at(cut.interval.t_max);
  for (int a = 0; a < 3; ++a) {
    const double plane = std::round(p[a]);
    distance = std::min(distance, std::max(std::abs(p[a] - plane), std::abs(q[a] - plane)));
  }
  return distance;
}

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

glm::dvec4 blend(const DenseVolume& volume, const View& view, const CutRay& cut) {
  const double unit = unitDistanceOf(volume);
  const DensityRange range = openedRange(volume, *view.range);
  double transmittance = 1;
  glm::dvec3 light(0);
  walkCells(cut.ray, 1, cut.interval, [&](glm::ivec3 cell, Interval piece) {
    const std::size_t voxel = volume.at(cell);
    if (!isVisible(volume, range, voxel)) return true;
    const Material material = materialAt(volume, view, voxel);
    const double optical_depth = material.sigma * ((piece.t_max - piece.t_min) / unit);
    light += transmittance * -std::expm1(-optical_depth) * material.color;
    transmittance *= std::exp(-optical_depth);
    return true;
  });
  return overBackground(view, light, transmittance);
}

void firstHit(const DenseVolume& volume, const View& view, const CutRay& cut, Pixel& pixel) {
  const DensityRange range = openedRange(volume, *view.range);
  pixel.edge_distance = cut.edge_distance;
  pixel.color = overBackground(view, glm::dvec3(0), 1);
  walkCells(cut.ray, 1, cut.interval, [&](glm::ivec3 cell, Interval piece) {
    pixel.edge_distance = std::min(pixel.edge_distance, pieceDistance(cut, cell, piece));
    const std::size_t voxel = volume.at(cell);
    if (!isVisible(volume, range, voxel)) return true;
    const Material material = materialAt(volume, view, voxel);
    if (volume.type != VoxelType::rgba8 && !(material.sigma > 0)) return true;
    pixel.voxel = cell;
    pixel.t = piece.t_min;
    pixel.color = glm::dvec4(material.color, 1);
    return false;
  });
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

void countBlocks(const DenseVolume& volume, const View& view, const CutRay& cut, Pixel& pixel) {
  pixel.color = overBackground(view, glm::dvec3(0), 1);
  const DensityRange range = openedRange(volume, *view.range);
  const unsigned bins = binsOf(volume, range);
  const double side = volume.block_voxels;
  CutRay coarse = cut;  // in units of a block, to measure distances
  coarse.ray.origin /= side;
  coarse.ray.direction /= side;
  double distance = cut.edge_distance / side;
  walkCells(cut.ray, volume.block_voxels, cut.interval, [&](glm::ivec3 cell, Interval piece) {
    distance = std::min(distance, pieceDistance(coarse, cell, piece));
    const BlockRange& block = volume.blocks[volume.blockAt(cell)];
    if (!block.stored) return true;
    // A value map of negative scale swaps the ends.
    const double end0 = volume.value_offset + volume.value_scale * static_cast<double>(block.density_min);
    const double end1 = volume.value_offset + volume.value_scale * static_cast<double>(block.density_max);
    const bool meets = std::max(end0, end1) >= range.lo && std::min(end0, end1) <= range.hi;
    pixel.blocks += meets && (block.bins & bins) != 0 ? 1 : 0;
    return true;
  });
  pixel.edge_distance = distance * side;
}

}  // namespace

std::array<std::uint8_t, 4> roundColor(const glm::dvec4& color) {
  std::array<std::uint8_t, 4> result{};
  for (int c = 0; c < 4; ++c) {
    BLOCKWALK_CHECK(color[c], >=, 0.0);
    BLOCKWALK_CHECK(color[c], <=, 1.0 + 1e-9);
    result[static_cast<std::size_t>(c)] = static_cast<std::uint8_t>(std::lround(color[c] * 255));
  }
  return result;
}

TransferPoint transferAt(const std::vector<TransferPoint>& transfer, double value) {
  BLOCKWALK_CHECK(transfer.size(), >, std::size_t{0});
  const auto above =
      std::find_if(transfer.begin(), transfer.end(), [&](const TransferPoint& point) { return point.value > value; });
  if (above == transfer.begin()) return transfer.front();
  if (above == transfer.end()) return transfer.back();
  const TransferPoint& below = *(above - 1);
  const double s = (value - below.value) / (above->value - below.value);
  return {.value = value,
          .color = below.color + s * (above->color - below.color),
          .opacity = below.opacity + s * (above->opacity - below.opacity)};
}

Pixel renderPixel(const DenseVolume& volume, const View& resolved, int x, int y) {
  const CutRay cut = cutRay(volume, resolved, x, y);
  Pixel pixel;
  pixel.face_distance = faceDistance(cut);
  switch (resolved.mode) {
    case Mode::blend:
      pixel.color = blend(volume, resolved, cut);
      break;
    case Mode::first_hit:
      firstHit(volume, resolved, cut, pixel);
      break;
    case Mode::blocks:
      countBlocks(volume, resolved, cut, pixel);
      break;
  }
  return pixel;
}

Image renderImage(const DenseVolume& volume, const View& resolved) {
  Image image{.width = resolved.width, .height = resolved.height};
  image.pixels.resize(static_cast<std::size_t>(resolved.width) * static_cast<std::size_t>(resolved.height));
  std::atomic<int> next_row{0};
  const auto work = [&] {
    for (int y = next_row++; y < resolved.height; y = next_row++) {
      for (int x = 0; x < resolved.width; ++x) {
        const std::size_t index =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(resolved.width) + static_cast<std::size_t>(x);
        image.pixels[index] = renderPixel(volume, resolved, x, y);
      }
    }
  };
  std::vector<std::jthread> threads;
  for (unsigned i = 1; i < std::thread::hardware_concurrency(); ++i) threads.emplace_back(work);
  work();
  return image;
}

}  // namespace blockwalk::reference
