// SPDX-License-Identifier: Apache-2.0
// The reference: float64 truth on the CPU for one pixel or a whole image, nearest filter. It shares no code with the
// kernels and none with the renderer, and it takes no short cut: no early ray termination, no skipping, no table.
//
// A voxel is visible when its density is finite, above the empty threshold, and within the view's range (data units,
// both ends included). An end of the range that excludes no voxel of level 0 excludes none of a coarser level. Over a
// length s inside a voxel of extinction sigma per unit distance the transmittance falls by exp(-sigma * s / unit); the
// unit distance is the smallest voxel spacing of level 0.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <vector>

#include "renderer/view.h"
#include "tests/reference/dense_volume.h"

namespace blockwalk::reference {

struct Pixel {
  glm::dvec4 color{0};       // straight red, green, blue, opacity, 0..1, not rounded; blocks: the background
  glm::ivec3 voxel{-1};      // first_hit: of the volume's level
  double t = 0;              // first_hit: world distance from the eye to the entry into the voxel
  std::uint32_t blocks = 0;  // blocks: stored blocks that meet the range and that the ray crosses with positive length
  // first_hit, blocks: how near the ray comes to where a rounding changes which cells it crosses, in voxels: the
  // distance to the nearest edge of a voxel before and at the hit (first_hit) or of a block (blocks), of the box that
  // it is cut to, and of the eye or a clip face to the next cell face along the ray. Infinite: not measured.
  double edge_distance = std::numeric_limits<double>::infinity();
  // All modes: the ray stays within this distance of one plane of voxel faces all the way, in voxels.
  double face_distance = std::numeric_limits<double>::infinity();
};

struct Image {
  int width = 0;
  int height = 0;
  std::vector<Pixel> pixels{};  // row 0 at the top
};

// 8-bit colour, rounded to nearest.
std::array<std::uint8_t, 4> roundColor(const glm::dvec4& color);

// Opacity over the unit distance and colour of a scalar, in data units: linear between points, constant beyond the
// ends.
TransferPoint transferAt(const std::vector<TransferPoint>& transfer, double value);

// The view is resolved (eye, target, up, range and, for scalars, transfer are there); its level is the volume's.
Pixel renderPixel(const DenseVolume& volume, const View& resolved, int x, int y);

// All pixels, on every core.
Image renderImage(const DenseVolume& volume, const View& resolved);

}  // namespace blockwalk::reference
