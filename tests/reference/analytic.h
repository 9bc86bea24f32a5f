// SPDX-License-Identifier: Apache-2.0
// Volumes whose field is known in closed form, as functions of the position in index space, and as dense volumes that
// hold the function at the voxel centres. All are level 0 with index space as world space.
#pragma once

#include <functional>
#include <glm/glm.hpp>

#include "tests/reference/dense_volume.h"
#include "view/view.h"

namespace blockwalk::reference {

struct Analytic {
  std::function<double(glm::dvec3)> value;         // stored units
  std::function<glm::dvec3(glm::dvec3)> gradient;  // stored units per voxel
};

Analytic constantField(double value);

// offset + slope . p: trilinear interpolation reproduces it half a voxel inside the volume and farther in.
Analytic rampField(double offset, glm::dvec3 slope);

// amplitude (1 - cos(2 pi |p - centre| / spacing)) / 2: shells of the given spacing, 0 at the centre.
Analytic shellsField(glm::dvec3 centre, double spacing, double amplitude);

// The signal of Marschner and Lobb 1994 on a cube of `side` voxels that stands for [-1, 1]^3, with their frequency 6
// and alpha 0.25; 0..1.
Analytic marschnerLobbField(int side);

// 0 and 255 by turns, at the voxel centres; between them the trilinear interpolation of that.
Analytic checkerboardField();

// The function at the voxel centres, rounded to the stored type; all voxels are there. The empty threshold lies below
// every value for f32 and is 0 else.
DenseVolume sampled(const Analytic& field, VoxelType type, glm::ivec3 dims);

// rgba8 or u8, all voxels empty but one.
DenseVolume oneVoxel(VoxelType type, glm::ivec3 dims, glm::ivec3 voxel, std::array<std::uint8_t, 4> rgba);

// Optical depth over a length, extinction per length, where opacity over one length goes straight from one end's to the
// other's: the mean of -ln(1 - opacity) in closed form, -[q ln q - q] / [q] with q = 1 - opacity.
double depthOfOpacityRamp(double opacity0, double opacity1, double length);

// One pixel, 1 x 1, that looks from the eye at the target through the linear filter: everything in range, extinction
// 0.3, step 0.5, nothing behind.
View linearView(glm::dvec3 eye, glm::dvec3 target, Mode mode = Mode::blend);

// Opacity and colour from `opacity0` and red at value `lo` straight to `opacity1` and blue at `hi`.
std::vector<TransferPoint> transferRamp(double lo, double opacity0, double hi, double opacity1);

// Integrals of the trilinear hat of one voxel of height 1 through its centre: along an axis, along a diagonal of a face
// and along one of the cube.
constexpr double kHatAlongAxis = 1;
double hatAlongFaceDiagonal();
double hatAlongCubeDiagonal();

}  // namespace blockwalk::reference
