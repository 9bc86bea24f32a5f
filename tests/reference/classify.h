// SPDX-License-Identifier: Apache-2.0
// What of a field is visible, and the extinction and colour it has there (docs/integration.md). Densities are in stored
// units, ranges and transfer functions in data units.
#pragma once

#include <glm/glm.hpp>
#include <limits>
#include <vector>

#include "tests/reference/dense_volume.h"
#include "view/view.h"

namespace blockwalk::reference {

// Of an opacity of 1, per unit distance.
constexpr double kOpaqueExtinction = 1e6;

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Material {
  glm::dvec3 color{0};
  double sigma = 0;  // extinction per unit distance
};

// What a view shows of a channel, ready to be asked point by point. Refers to both.
struct Classifier {
  const DenseVolume& volume;
  const View& view;
  const ChannelView& look;
  DensityRange range{};        // data units; ends that exclude no non-empty voxel of level 0 are infinite
  bool needs_opacity = false;  // a visible point must have an opacity above 0

  Classifier(const DenseVolume& volume, const View& view);

  double dataOf(double stored) const { return volume.value_offset + volume.value_scale * stored; }
  double storedOf(double data) const { return (data - volume.value_offset) / volume.value_scale; }
  bool isVisible(double density) const;
  // Attenuated-mip: where in the view's range a density lies, 0..1, and the density that lies there.
  double shareOf(double density) const;
  double densityAt(double share) const;

  // Of a value of the field (tests/reference/field.h), visible or not.
  Material materialAt(const glm::dvec4& field) const;

  // Means over the densities from f to g taken as equally long: of the visible extinction, and of the colour weighted
  // by it (Engel, Kraus, Ertl 2001, without attenuation inside). Scalars.
  Material meanMaterial(double f, double g) const;

  // Densities at which a sample jumps: from visible to invisible and, where it is coloured one by one, as
  // transferJumps().
  std::vector<double> jumps() const;
  // Densities at which the transfer function jumps: to the next step, to opaque, for first_hit into sight.
  std::vector<double> transferJumps() const;
  // Ends of what is visible and all points of the transfer function: between them all is smooth.
  std::vector<double> kinks() const;
};

// The straight line, or the constant, that a transfer function is around a value.
struct TransferPiece {
  TransferPoint at_value{};  // at the value asked for
  glm::dvec3 color_slope{0};
  double opacity_slope = 0;  // per data unit

  TransferPoint at(double value) const;
};
TransferPiece transferPieceAt(const std::vector<TransferPoint>& transfer, double value, TransferShape shape);

// Extinction per unit distance of an opacity over the unit distance.
double extinctionOf(double opacity);

// The finite of them, ascending, each once.
void sortUnique(std::vector<double>& values);

}  // namespace blockwalk::reference
