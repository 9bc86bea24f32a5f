// SPDX-License-Identifier: Apache-2.0
// The reference: float64 truth on the CPU for one pixel or a whole image, written from docs/integration.md. It shares
// no code with the kernels and none with the renderer, and it takes no short cut: no early ray termination, no
// skipping, no table.
//
// A voxel is visible when its density is finite, above the empty threshold, and within the view's range (data units,
// both ends included). An end of the range that excludes no voxel of level 0 excludes none of a coarser level. Over a
// length s inside a voxel of extinction sigma per unit distance the transmittance falls by exp(-sigma * s / unit); the
// unit distance is the smallest voxel spacing of level 0. The linear filter takes its samples on the documented
// lattice, so that a kernel can be compared sample for sample; tests/reference/converged.h is its limit for small
// steps.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <limits>
#include <span>
#include <vector>

#include "tests/reference/dense_volume.h"
#include "tests/reference/ray.h"
#include "view/view.h"

namespace blockwalk::reference {

struct Pixel {
  glm::dvec4 color{0};  // straight red, green, blue, opacity, 0..1, not rounded; blocks: the background
  glm::ivec3 voxel{
      -1};  // first_hit, iso, mip and its kind: the voxel, of the volume's level, that the point shown lies in
  // World distance from the eye to the point shown. first_hit, iso and where one density is shown: to the voxel above;
  // nearest: to its entry. blend: to where the opacity gathered first reaches a half. 0 where shows_point is false.
  double t = 0;
  bool shows_point = false;
  // Data units: density there; mean: the mean; blend: that of the piece in which the point lies, linear: of its sample,
  // pre-integrated: the mean of its two ends. NaN: nothing.
  double value = std::numeric_limits<double>::quiet_NaN();
  double visible_length = 0;  // mean: of the ray, world
  std::uint32_t blocks = 0;   // blocks: stored blocks that meet the range and that the ray crosses with positive length

  // How near the pixel is to being another one by rounding alone. Infinite: not measured, or nothing is near.
  //
  // Nearest first_hit, iso, mip and blocks: how near the ray comes to where a rounding changes which cells it crosses,
  // in voxels: the distance to the nearest edge of a voxel before and at the hit or of a block (blocks), of the box
  // that it is cut to, and of the eye or a clip face to the next cell face along the ray. Linear: to the box's edges
  // alone.
  double edge_distance = std::numeric_limits<double>::infinity();
  // All modes: the ray stays within this distance of one plane of voxel faces all the way, in voxels.
  double face_distance = std::numeric_limits<double>::infinity();
  // Linear: how near the density of a sample that counts (first_hit, iso: up to the hit's) comes to one at which what
  // is seen jumps: an end of the range, the empty threshold, a step of the transfer function. Stored units. Samples
  // among eight equal voxels do not count: they are exact in any arithmetic. minip: how near a sample is to the face
  // behind which it would or would not count, a voxel taken as the contrast.
  double margin = std::numeric_limits<double>::infinity();
  // Linear: how near an end of the ray's part is to a point of the lattice, in steps: a sample may come or go there.
  double lattice_distance = std::numeric_limits<double>::infinity();
  // Linear first_hit, iso: how fast the density changes along the ray at the hit, stored units per world unit. An error
  // e of the density moves t by e / |slope|. At the ray's entry t is exact whatever the slope.
  double slope = 0;
  bool at_entry = false;  // linear first_hit, iso: what is hit is where the ray enters
  // Linear mip, minip, attenuated-mip of rgba8: the largest difference in a channel between the colour shown and that
  // of another visible sample whose density is within 1e-4 (stored units) of the one shown, or whose share of the range
  // as attenuated within 1e-6, unless both are among equal voxels.
  double rival_difference = 0;
  // blend: t as it were if the optical depth that makes an opacity of a half were kHalfMargin less or more; infinite
  // where even that is not reached.
  double t_early = std::numeric_limits<double>::infinity();
  double t_late = std::numeric_limits<double>::infinity();
  double value_early = std::numeric_limits<double>::quiet_NaN();  // of the pieces there
  double value_late = std::numeric_limits<double>::quiet_NaN();
};

constexpr double kHalfMargin = 1e-4;

struct Image {
  int width = 0;
  int height = 0;
  std::vector<Pixel> pixels{};  // row 0 at the top
};

// 8-bit colour, rounded to nearest.
std::array<std::uint8_t, 4> roundColor(const glm::dvec4& color);

// Opacity over the unit distance and colour of a scalar, in data units: linear between points or held up to the next,
// constant beyond the ends.
TransferPoint transferAt(const std::vector<TransferPoint>& transfer, double value,
                         TransferShape shape = TransferShape::linear);

// The view is resolved (eye, target, up, range and, for scalars, transfer are there); its level is the volume's.
// `within`: of the ray, nothing else is looked at. `sample`: of the pixel's, for what is drawn with a lens or with rays
// around.
Pixel renderPixel(const DenseVolume& volume, const View& resolved, int x, int y, glm::dvec2 place = kPixelCentre,
                  Interval within = {.t_min = 0, .t_max = std::numeric_limits<double>::infinity()}, int sample = 0);

// Of several levels of one channel (docs/integration.md, Level of detail): the finest that is drawn first, then all
// that are coarser, up to the last that the view's pixels ask for. Distances, margins and the slope are not measured.
Image renderLevels(std::span<const DenseVolume> levels, const View& resolved);

// Of several channels of one volume, those that the view draws (docs/integration.md, Channels); of one the same as
// above, but that the margin is a share of the contrast, as it is of several. Of several the distances to edges, the
// value and the slope are not measured. One sample a pixel.
Pixel renderPixel(std::span<const DenseVolume> drawn, const View& resolved, int x, int y, glm::dvec2 place);
Image renderImage(std::span<const DenseVolume> drawn, const View& resolved);

// Where in a pixel its sample `index` lies, of several (docs/integration.md, Samples of a pixel).
glm::dvec2 placeOfSample(int x, int y, int index);

// All pixels, on every core. Of several samples a pixel has the mean of their colours, premultiplied, and the least of
// their distances and margins; it has no voxel, t or value.
Image renderImage(const DenseVolume& volume, const View& resolved);

}  // namespace blockwalk::reference
