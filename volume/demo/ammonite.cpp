// SPDX-License-Identifier: Apache-2.0
#include "volume/demo/ammonite.h"

#include <algorithm>
#include <cmath>

namespace blockwalk {
namespace {

constexpr double kExpansion = 2.05;   // of the radius in one turn
constexpr double kTube = 0.375;       // radius of the tube over that of the centre line: whorls just overlap
constexpr double kTubeAspect = 0.92;  // thickness over height of the tube
constexpr double kTurns = 5.2;        // wound, from the aperture inwards
constexpr double kBodyChamber = 0.6;  // turns without septa
constexpr double kSeptaATurn = 17;
constexpr double kRibHeight = 0.055;

glm::dvec3 rainbow(double t) {
  return {132 + 105 * wave(t + 0.27), 128 + 92 * wave(t + 0.93), 122 + 95 * wave(t + 0.60)};
}

}  // namespace

Ammonite::Ammonite(const Shape& shape)
    : shape_(shape),
      center_radius_(shape.radius / ((1 + kTube) * (1 + kRibHeight))),
      stain_(shape.seed + 1),
      erosion_(shape.seed + 2, 3),
      crystal_(shape.seed + 3) {
  const double thickness = center_radius_ * kTube * kTubeAspect * (1 + kRibHeight);
  for (int i = 0; i < 3; ++i) {
    const glm::dvec3 along(shape.frame[0][i], shape.frame[1][i], shape.frame[2][i]);
    const double in_plane = std::sqrt(along.x * along.x + along.y * along.y);
    extent_[i] = shape.radius * in_plane + thickness * std::fabs(along.z) + 2 * shape.voxel;
  }
}

std::optional<Ammonite::Position> Ammonite::locate(glm::dvec3 point) const {
  const glm::dvec3 d = point - shape_.center;
  const double a = glm::dot(shape_.frame[0], d);
  const double b = glm::dot(shape_.frame[1], d);
  const double w = glm::dot(shape_.frame[2], d);
  const double rho = std::sqrt(a * a + b * b);
  const double thickest = kTube * kTubeAspect * (1 + kRibHeight) * std::min(center_radius_, rho / (1 - kTube));
  if (rho > shape_.radius || rho <= 0 || std::fabs(w) > thickest) return std::nullopt;
  const double angle = angleTurns(a, b);
  static const double log_expansion = logTwo(kExpansion);
  const double exact = logTwo(rho / center_radius_) / log_expansion;
  const double nearest = std::floor(exact - angle + 0.5) + angle;
  std::optional<Position> best;
  for (const double turn : {nearest, nearest + 1}) {
    if (turn > 0 || turn < -kTurns) continue;
    Position position{.turn = turn, .radius = center_radius_ * powTwo(turn * log_expansion)};
    const double tube = kTube * position.radius;
    position.outward = (rho - position.radius) / tube;
    position.across = w / (tube * kTubeAspect);
    position.distance = std::sqrt(position.outward * position.outward + position.across * position.across);
    if (!best || position.distance < best->distance) best = position;
  }
  return best;
}

// Ribs lean forwards, fork half-way up the side and fade on the inner wall.
double Ammonite::ribHeight(const Position& position) const {
  const double lean = 0.35 * position.outward * position.outward;
  const double phase = position.turn * shape_.ribs + lean;
  const double single = 0.5 + 0.5 * wave(phase);
  const double forked = 0.5 + 0.5 * wave(2 * phase);
  const double rib = mixed(single, forked, smoothStep(0.05, 0.45, position.outward));
  return rib * rib * smoothStep(-0.95, -0.3, position.outward);
}

Matter Ammonite::shellAt(glm::dvec3 point, const Position& position, double rib) {
  const double stain = stain_.at(point * (4.0 / shape_.radius));
  const double hue = 1.1 * stain + 0.35 * position.turn + 0.12 * position.outward;
  const glm::dvec3 pearl(238, 214, 176);
  const glm::dvec3 sheen = glm::mix(pearl, rainbow(hue), 0.22 + 0.5 * smoothStep(0.3, 0.75, stain));
  return {sheen * (0.62 + 0.38 * rib), 226 + 29 * rib};
}

Matter Ammonite::insideAt(glm::dvec3 point, const Position& position) {
  // A siphuncle runs along the outer wall through all chambers.
  const double siphuncle = std::hypot(position.outward - 0.82, position.across);
  const bool chambered = position.turn < -kBodyChamber;
  if (chambered && siphuncle < 0.09) return Matter{{196, 92, 54}, 238};
  const double crystal = crystal_.at(point * (60.0 / shape_.radius));
  // The animal lived in the last chamber; fine mud filled it and turned to pale stone.
  if (!chambered) return Matter{glm::dvec3(196, 178, 150) * (0.8 + 0.25 * crystal), 150 + 12 * crystal};

  // Towards the wall a septum folds more and more finely: where it meets the shell is the suture line.
  const double around = angleTurns(position.outward, position.across);
  const double q2 = position.distance * position.distance;
  const double folds =
      0.22 * q2 * wave(4 * around) + 0.16 * q2 * q2 * wave(11 * around + 0.2) + 0.10 * q2 * q2 * q2 * wave(29 * around);
  const double phase = position.turn * kSeptaATurn - 0.35 * q2 + folds;
  const double chamber = std::floor(phase);
  const double from_septum = std::min(phase - chamber, chamber + 1 - phase);
  const double spacing = 6.2832 * position.radius / kSeptaATurn;
  const double half_wall = std::max(0.05, 0.75 * shape_.voxel / spacing);
  if (from_septum < half_wall) return Matter{{242, 226, 198}, 214};

  const double fill = hashUnit(hashCell(static_cast<std::int32_t>(chamber), 0, 0, shape_.seed));
  // Darker and clearer in the middle of a chamber, as crystals grow inwards from its walls.
  const double depth = smoothStep(half_wall, 0.5, from_septum) * (1 - q2);
  if (fill < 0.18) return Matter{glm::dvec3(196, 168, 84) * (0.75 + 0.35 * crystal), 196 + 10 * crystal};
  const glm::dvec3 rim = fill < 0.5 ? glm::dvec3(206, 150, 84) : glm::dvec3(214, 128, 62);
  const glm::dvec3 core = fill < 0.5 ? glm::dvec3(120, 66, 30) : glm::dvec3(150, 58, 28);
  return Matter{glm::mix(rim, core, depth) * (0.82 + 0.3 * crystal), 154 + 18 * (1 - depth) + 8 * crystal};
}

std::optional<Matter> Ammonite::at(glm::dvec3 point) {
  auto position = locate(point);
  if (!position || position->distance > 1 + kRibHeight) return std::nullopt;
  const double rib = ribHeight(*position);
  position->distance /= 1 + kRibHeight * rib;
  if (position->distance > 1) return std::nullopt;
  const double tube = kTube * kTubeAspect * position->radius;
  const double wall = std::max(0.08, 2.0 * shape_.voxel / tube);
  // Here and there the shell is lost and shows the sutures on the cast of the chambers.
  const bool lost = position->turn < -kBodyChamber && erosion_.at(point * (7.0 / shape_.radius)) > 0.60;
  if (position->distance > 1 - wall && !lost) return shellAt(point, *position, rib);
  return insideAt(point, *position);
}

}  // namespace blockwalk
