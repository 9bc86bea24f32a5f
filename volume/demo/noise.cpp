// SPDX-License-Identifier: Apache-2.0
#include "volume/demo/noise.h"

#include <bit>
#include <cmath>

namespace blockwalk {
namespace {
double eased(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }
}  // namespace

double Noise::at(glm::dvec3 p) {
  const glm::dvec3 low = glm::floor(p);
  const glm::ivec3 cell(low);
  if (cell != cell_) {
    cell_ = cell;
    for (int i = 0; i < 8; ++i) {
      corners_[static_cast<std::size_t>(i)] =
          hashUnit(hashCell(cell.x + (i & 1), cell.y + (i >> 1 & 1), cell.z + (i >> 2), seed_));
    }
  }
  const double x = eased(p.x - low.x);
  const double y = eased(p.y - low.y);
  const double z = eased(p.z - low.z);
  const double near = mixed(mixed(corners_[0], corners_[1], x), mixed(corners_[2], corners_[3], x), y);
  const double far = mixed(mixed(corners_[4], corners_[5], x), mixed(corners_[6], corners_[7], x), y);
  return mixed(near, far, z);
}

FractalNoise::FractalNoise(std::uint32_t seed, int octaves)
    : noises_{Noise(seed),       Noise(seed + 101), Noise(seed + 211),
              Noise(seed + 307), Noise(seed + 401), Noise(seed + 503)},
      octaves_(octaves) {}

double FractalNoise::at(glm::dvec3 p) {
  double sum = 0;
  double weight = 1;
  double weights = 0;
  for (int i = 0; i < octaves_; ++i) {
    sum += weight * noises_[static_cast<std::size_t>(i)].at(p);
    weights += weight;
    weight *= 0.5;
    p = p * 2.03 + 17.3;  // off the finer lattice's corners, where all octaves would agree
  }
  return sum / weights;
}

double wave(double turns) {
  const double t = turns - std::floor(turns);
  const double u = t < 0.5 ? t : t - 0.5;
  const double arch = u * (0.5 - u);                  // 0..1/16
  const double sine = 16 * arch / (1.25 - 4 * arch);  // Bhaskara
  return t < 0.5 ? sine : -sine;
}

double angleTurns(double x, double y) {
  const double ax = std::fabs(x);
  const double ay = std::fabs(y);
  const double large = ax > ay ? ax : ay;
  if (large == 0) return 0;
  const double t = (ax > ay ? ay : ax) / large;
  const double s = t * t;
  // atan(t) / 2 pi on 0..1, least squares
  const double octant =
      t * (0.15914 + s * (-0.05288 + s * (0.03058 + s * (-0.01795 + s * (0.00754 + s * (-0.00143))))));
  double turns = ax > ay ? octant : 0.25 - octant;
  if (x < 0) turns = 0.5 - turns;
  if (y < 0) turns = 1 - turns;
  return turns >= 1 ? 0 : turns;
}

double logTwo(double x) {
  const auto bits = std::bit_cast<std::uint64_t>(x);
  double exponent = static_cast<double>(static_cast<int>(bits >> 52 & 0x7ff) - 1023);
  double m = std::bit_cast<double>((bits & 0xfffffffffffffull) | 0x3ff0000000000000ull);
  if (m > 1.4142135623730951) {
    m *= 0.5;
    exponent += 1;
  }
  const double s = (m - 1) / (m + 1);
  const double s2 = s * s;
  return exponent + s * (2 + s2 * (2.0 / 3 + s2 * (2.0 / 5 + s2 * (2.0 / 7 + s2 * (2.0 / 9))))) * 1.4426950408889634;
}

double powTwo(double x) {
  const double whole = std::floor(x + 0.5);
  const double f = (x - whole) * 0.6931471805599453;
  const double part = 1 + f * (1 + f * (1.0 / 2 + f * (1.0 / 6 + f * (1.0 / 24 + f * (1.0 / 120 + f / 720)))));
  const auto exponent = static_cast<std::uint64_t>(static_cast<std::int64_t>(whole) + 1023);
  return part * std::bit_cast<double>(exponent << 52);
}

void writeMatter(const Matter& matter, std::byte* voxel) {
  const auto quantised = [](double value) {
    return static_cast<std::byte>(value <= 0 ? 0 : value >= 255 ? 255 : static_cast<int>(std::floor(value + 0.5)));
  };
  voxel[0] = quantised(matter.color.x);
  voxel[1] = quantised(matter.color.y);
  voxel[2] = quantised(matter.color.z);
  voxel[3] = quantised(matter.density);
}

glm::dmat3 frameAround(glm::dvec3 normal, double spin_turns) {
  const glm::dvec3 n = glm::normalize(normal);
  const glm::dvec3 a = glm::normalize(glm::cross(glm::dvec3(0, 1, 0), n));
  const glm::dvec3 b = glm::cross(n, a);
  const double s = wave(spin_turns);
  const double c = wave(spin_turns + 0.25);
  const glm::dvec3 first = glm::normalize(a * c + b * s);  // wave is only close to a sine
  return {first, glm::cross(n, first), n};
}

}  // namespace blockwalk
