// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/analytic.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "volume/error.h"

namespace blockwalk::reference {
namespace {

constexpr double kPi = std::numbers::pi;

// A wave of period 2 that is 1 at 0.5, -1 at 1.5 and straight between.
double triangleWave(double x) {
  const double phase = x - 0.5 - 2 * std::floor((x - 0.5) / 2);  // 0..2
  return 1 - 2 * std::min(phase, 2 - phase);
}

double triangleSlope(double x) {
  const double phase = x - 0.5 - 2 * std::floor((x - 0.5) / 2);
  return phase < 1 ? -2 : 2;
}

void setVoxel(DenseVolume& volume, glm::ivec3 voxel, double value) {
  constexpr double kGreatest[] = {0, 255, 255, 65535};
  if (volume.type != VoxelType::f32) {
    value = std::round(value);
    BLOCKWALK_CHECK(value, >=, 0.0);
    BLOCKWALK_CHECK(value, <=, kGreatest[static_cast<int>(volume.type)]);
  }
  volume.density[volume.at(voxel)] = static_cast<float>(value);
}

}  // namespace

Analytic constantField(double value) {
  return {.value = [=](glm::dvec3) { return value; }, .gradient = [](glm::dvec3) { return glm::dvec3(0); }};
}

Analytic rampField(double offset, glm::dvec3 slope) {
  return {.value = [=](glm::dvec3 p) { return offset + glm::dot(slope, p); },
          .gradient = [=](glm::dvec3) { return slope; }};
}

Analytic shellsField(glm::dvec3 centre, double spacing, double amplitude) {
  const double frequency = 2 * kPi / spacing;
  return {.value = [=](glm::dvec3 p) { return amplitude * (1 - std::cos(frequency * glm::length(p - centre))) / 2; },
          .gradient =
              [=](glm::dvec3 p) {
                const double radius = glm::length(p - centre);
                if (radius == 0) return glm::dvec3(0);
                return amplitude * frequency * std::sin(frequency * radius) / 2 * (p - centre) / radius;
              }};
}

Analytic marschnerLobbField(int side) {
  constexpr double kFrequency = 6, kAlpha = 0.25;
  const auto unit = [=](glm::dvec3 p) { return 2.0 * p / static_cast<double>(side) - 1.0; };
  const auto rho = [](double r) { return std::cos(2 * kPi * kFrequency * std::cos(kPi * r / 2)); };
  const auto rho_slope = [](double r) {
    return std::sin(2 * kPi * kFrequency * std::cos(kPi * r / 2)) * kPi * kPi * kFrequency * std::sin(kPi * r / 2);
  };
  return {.value =
              [=](glm::dvec3 p) {
                const glm::dvec3 q = unit(p);
                return (1 - std::sin(kPi * q.z / 2) + kAlpha * (1 + rho(std::hypot(q.x, q.y)))) / (2 * (1 + kAlpha));
              },
          .gradient =
              [=](glm::dvec3 p) {
                const glm::dvec3 q = unit(p);
                const double r = std::hypot(q.x, q.y);
                const glm::dvec2 outward = r > 0 ? glm::dvec2(q) / r : glm::dvec2(0);
                const glm::dvec3 slope(kAlpha * rho_slope(r) * outward, -kPi / 2 * std::cos(kPi * q.z / 2));
                return slope / (2 * (1 + kAlpha)) * 2.0 / static_cast<double>(side);
              }};
}

Analytic checkerboardField() {
  return {.value = [](glm::dvec3 p) { return 127.5 * (1 + triangleWave(p.x) * triangleWave(p.y) * triangleWave(p.z)); },
          .gradient =
              [](glm::dvec3 p) {
                const glm::dvec3 wave(triangleWave(p.x), triangleWave(p.y), triangleWave(p.z));
                return 127.5 * glm::dvec3(triangleSlope(p.x) * wave.y * wave.z, wave.x * triangleSlope(p.y) * wave.z,
                                          wave.x * wave.y * triangleSlope(p.z));
              }};
}

DenseVolume sampled(const Analytic& field, VoxelType type, glm::ivec3 dims) {
  BLOCKWALK_CHECK(type != VoxelType::rgba8, ==, true);
  DenseVolume volume = emptyVolume(type, dims);
  for (int z = 0; z < dims.z; ++z) {
    for (int y = 0; y < dims.y; ++y) {
      for (int x = 0; x < dims.x; ++x) setVoxel(volume, {x, y, z}, field.value(glm::dvec3(x, y, z) + 0.5));
    }
  }
  if (type == VoxelType::f32) volume.empty_threshold = *std::ranges::min_element(volume.density) - 1;
  deriveBlocks(volume, volume.block_voxels);
  return volume;
}

DenseVolume oneVoxel(VoxelType type, glm::ivec3 dims, glm::ivec3 voxel, std::array<std::uint8_t, 4> rgba) {
  DenseVolume volume = emptyVolume(type, dims);
  volume.density[volume.at(voxel)] = static_cast<float>(rgba[3]);
  if (type == VoxelType::rgba8) volume.color[volume.at(voxel)] = {rgba[0], rgba[1], rgba[2]};
  deriveBlocks(volume, volume.block_voxels);
  return volume;
}

double depthOfOpacityRamp(double opacity0, double opacity1, double length) {
  const double q0 = 1 - opacity0, q1 = 1 - opacity1;
  if (q0 == q1) return -std::log(q0) * length;
  const auto integral = [](double q) { return q > 0 ? q - q * std::log(q) : 0; };
  return length * (integral(q1) - integral(q0)) / (q1 - q0);
}

View linearView(glm::dvec3 eye, glm::dvec3 target, Mode mode) {
  View view;
  view.width = view.height = 1;
  view.eye = eye;
  view.target = target;
  view.up = glm::dvec3(0.03, 1, 0.02);
  view.channels[0].range = DensityRange{.lo = -1e30, .hi = 1e30};
  view.mode = mode;
  view.filter = Filter::linear;
  view.step = 0.5;
  view.extinction = 0.3;
  view.background = {0, 0, 0, 0};
  return view;
}

std::vector<TransferPoint> transferRamp(double lo, double opacity0, double hi, double opacity1) {
  return {{.value = lo, .color = {1, 0, 0}, .opacity = opacity0},
          {.value = hi, .color = {0, 0, 1}, .opacity = opacity1}};
}

double hatAlongFaceDiagonal() { return 2 * std::numbers::sqrt2 / 3; }
double hatAlongCubeDiagonal() { return std::numbers::sqrt3 / 2; }

}  // namespace blockwalk::reference
