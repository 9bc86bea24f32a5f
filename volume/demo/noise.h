// SPDX-License-Identifier: Apache-2.0
// Deterministic noise and the few curves that procedural volumes need.
//
// Everything here is integer hashing and IEEE +, -, *, /, sqrt and floor, which round alike everywhere; the functions
// of the C library do not, so none of them decides a voxel.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>

namespace blockwalk {

constexpr std::uint32_t hashBits(std::uint32_t bits) {
  bits ^= bits >> 16;
  bits *= 0x7feb352du;
  bits ^= bits >> 15;
  bits *= 0x846ca68bu;
  bits ^= bits >> 16;
  return bits;
}
constexpr std::uint32_t hashCell(std::int32_t x, std::int32_t y, std::int32_t z, std::uint32_t seed) {
  const std::uint32_t h = hashBits(static_cast<std::uint32_t>(x) * 0x9e3779b1u + seed);
  return hashBits((h ^ static_cast<std::uint32_t>(y) * 0x85ebca77u) + static_cast<std::uint32_t>(z) * 0xc2b2ae3du);
}
// 0 <= result < 1
constexpr double hashUnit(std::uint32_t bits) { return static_cast<double>(bits >> 8) * (1.0 / 16777216.0); }

// A stream of hashed numbers, for placing things. Take one a statement or inside braces: the order in which a call's
// arguments are made is each compiler's own.
class HashSequence {
 public:
  explicit HashSequence(std::uint32_t seed) : seed_(seed) {}
  std::uint32_t bits() { return hashBits(seed_ + 0x9e3779b9u * ++count_); }
  double unit() { return hashUnit(bits()); }
  double between(double lo, double hi) { return lo + (hi - lo) * unit(); }

 private:
  std::uint32_t seed_;
  std::uint32_t count_ = 0;
};

// Value noise in 0..1, smooth, one lattice cell a unit. Remembers the last cell: neighbours along a row share it.
class Noise {
 public:
  explicit Noise(std::uint32_t seed) : seed_(seed) {}
  double at(glm::dvec3 p);

 private:
  std::uint32_t seed_;
  glm::ivec3 cell_{INT32_MIN};
  std::array<double, 8> corners_{};
};

// Octaves of noise, each twice as fine and half as strong as the one before; 0..1, mostly near 0.5.
class FractalNoise {
 public:
  FractalNoise(std::uint32_t seed, int octaves);
  double at(glm::dvec3 p);

 private:
  static constexpr int kMaxOctaves = 6;
  std::array<Noise, kMaxOctaves> noises_;
  int octaves_;
};

// 0 below lo, 1 above hi, smooth between
inline double smoothStep(double lo, double hi, double x) {
  const double t = x <= lo ? 0 : x >= hi ? 1 : (x - lo) / (hi - lo);
  return t * t * (3 - 2 * t);
}
inline double mixed(double a, double b, double t) { return a + (b - a) * t; }

// close to sin(2 pi t)
double wave(double turns);
// angle of (x, y) in turns, 0..1
double angleTurns(double x, double y);
double logTwo(double x);  // x > 0
double powTwo(double x);  // |x| < 1000

// A colour and a density as they are written to an rgba8 voxel; components 0..255.
struct Matter {
  glm::dvec3 color{0};
  double density = 0;
};
void writeMatter(const Matter& matter, std::byte* voxel);

// Three orthonormal axes, the third along `normal`, which is not vertical; the first two are spun around it.
glm::dmat3 frameAround(glm::dvec3 normal, double spin_turns);

}  // namespace blockwalk
