// SPDX-License-Identifier: Apache-2.0
// An ammonite: a tube wound into a logarithmic spiral (Raup 1966), with ribs outside, and septa that fold into sutures
// inside.
#pragma once

#include <glm/glm.hpp>
#include <optional>

#include "volume/demo/noise.h"

namespace blockwalk {

class Ammonite {
 public:
  struct Shape {
    glm::dvec3 center{0};
    double radius = 1;      // from the spiral's axis to the outermost point
    glm::dmat3 frame{1.0};  // two axes of the spiral's plane, then its normal
    int ribs = 38;          // a turn
    double voxel = 0;       // side of a voxel: walls are no thinner
    std::uint32_t seed = 0;
  };
  explicit Ammonite(const Shape& shape);

  // half the side of the box around center() that holds it
  glm::dvec3 extent() const { return extent_; }
  glm::dvec3 center() const { return shape_.center; }
  // The matter at a point: shell, septum or filling; nothing outside.
  std::optional<Matter> at(glm::dvec3 point);

 private:
  struct Position {
    double turn = 0;      // along the spiral, 0 at the aperture, negative inwards
    double radius = 0;    // of the tube's centre line here
    double outward = 0;   // in the tube's cross-section, 1 at its outer wall
    double across = 0;    // along the spiral's normal, 1 at its side wall
    double distance = 0;  // from the centre line, 1 at the wall
  };
  std::optional<Position> locate(glm::dvec3 point) const;
  double ribHeight(const Position& position) const;
  Matter shellAt(glm::dvec3 point, const Position& position, double rib);
  Matter insideAt(glm::dvec3 point, const Position& position);

  Shape shape_;
  double center_radius_;  // of the centre line at the aperture
  glm::dvec3 extent_;
  Noise stain_;
  FractalNoise erosion_;
  Noise crystal_;
};

}  // namespace blockwalk
