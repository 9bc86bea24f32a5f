// SPDX-License-Identifier: Apache-2.0
// Extinction from 1e-12 to 1e12 a voxel, optical depths where 1 - exp(-x) cancels, sums of very many small pieces.
#include <fmt/format.h>

#include <cmath>

#include "tests/extreme/cases.h"
#include "tests/extreme/gauge.h"
#include "tests/extreme/volumes.h"

namespace blockwalk::extreme {
namespace {

constexpr double kDepthBound = 1e-4;

// A bar along z, `width` voxels thick, seen along it by parallel rays that lean a little, or exactly.
View alongBar(int width, int length, const glm::dmat4& map, bool leaning) {
  const glm::dvec3 middle(0.52 * width, 0.515 * width, length / 2.0);
  const glm::dvec3 lean = leaning ? glm::dvec3(0.14, 0.07, 0) * static_cast<double>(width) : glm::dvec3(0);
  return lookStraight(map, middle + lean + glm::dvec3(0, 0, length / 2.0 + 30), middle, {0, 1, 0}, width / 24.0);
}

Case uniform(int exponent) {
  return {fmt::format("extinction_1e{}{}", exponent < 0 ? "_" : "", std::abs(exponent)),
          fmt::format("rgba8, extinction 1e{} a voxel, 50 voxels deep", exponent), [=] {
            const double extinction = std::pow(10.0, exponent);
            Scenario scenario{
                .source = fill(VoxelType::rgba8, {12, 12, 50}, [](glm::ivec3) { return 255.0f; }),
                .view = look(glm::dmat4(1), {20, 30, 90}, {6, 6, 25}),
            };
            scenario.view.extinction = extinction;
            scenario.blank = extinction * 50 < 1e-3;
            return imageError(scenario);
          }};
}

// `haze` voxels of density 1 before (or behind) a wall of density 255, seen along z where a voxel is `stretch` unit
// distances long, so that opacity 1 (1e6 a unit distance) is stretch * 1e6 a voxel.
Case wall(std::string name, std::string what, int haze, double stretch, double haze_a_voxel, bool behind,
          glm::dvec3 haze_color) {
  return {std::move(name), std::move(what), [=] {
            const glm::dmat4 map = spacing({1, 1, stretch});
            const auto isWall = [=](glm::ivec3 voxel) { return behind ? voxel.z == haze : voxel.z == 0; };
            Scenario scenario{
                .source = fill(
                    VoxelType::u8, {12, 12, haze + 1}, [=](glm::ivec3 v) { return isWall(v) ? 255.0f : 1.0f; }, map),
                .view = alongBar(12, haze + 1, map, true),
                .filters = {Filter::nearest},
            };
            scenario.view.channels[0].transfer = {
                {.value = 1, .color = haze_color, .opacity = -std::expm1(-haze_a_voxel / stretch)},
                {.value = 255, .color = {1, 0.5, 0.25}, .opacity = 1}};
            return imageError(scenario);
          }};
}

struct Sum {
  std::string name;
  std::string what;
  int voxels = 10000;
  int byte = 0;
  bool dark = false;
  bool leaning = false;
  std::vector<Filter> filters{Filter::nearest};
  double step = 0.5;
  Density density = [](glm::ivec3) { return 200.0f; };
};

// u8, of one opacity for all values above 0.
Case sum(const Sum& sum) {
  return {sum.name, sum.what,
          [=] {
            Scenario scenario{.source = fill(VoxelType::u8, {2, 2, sum.voxels}, sum.density),
                              .view = alongBar(2, sum.voxels, glm::dmat4(1), sum.leaning),
                              .filters = sum.filters};
            scenario.view.step = sum.step;
            const auto set_strength = [dark = sum.dark](View& view, double strength) {
              view.channels[0].transfer = white(-std::expm1(-strength));
              if (dark) view.channels[0].transfer[0].color = glm::dvec3(0);
            };
            // A fourfold error either way would show as one.
            const double red = (sum.byte + 0.5) / 255;
            const double expected = (sum.dark ? -std::log(red) : -std::log1p(-red)) / sum.voxels;
            return depthError({.scenario = std::move(scenario),
                               .set_strength = set_strength,
                               .lo = expected / 4,
                               .hi = expected * 4,
                               .byte = sum.byte,
                               .dark = sum.dark});
          },
          Unit::relative, kDepthBound};
}

void addSums(std::vector<Case>& cases) {
  const Density mixed = [](glm::ivec3 v) { return noise(v) < 0.5 ? 0.0f : 200.0f; };
  cases.push_back(sum({.name = "sum_10000", .what = "10,000 voxels of opacity 2e-7, what they gather"}));
  cases.push_back(sum(
      {.name = "sum_10000_dark", .what = "10,000 voxels of opacity 2e-7, transmittance", .byte = 254, .dark = true}));
  cases.push_back(sum({.name = "sum_10000_half", .what = "10,000 voxels of opacity 7e-5", .byte = 127}));
  cases.push_back(sum({.name = "sum_10000_nearly_opaque",
                       .what = "10,000 voxels that leave 1/510 of the light",
                       .byte = 0,
                       .dark = true}));
  cases.push_back(sum({.name = "sum_10000_mixed",
                       .what = "10,000 voxels, half of them empty, leaning rays",
                       .leaning = true,
                       .density = mixed}));
  cases.push_back(sum({.name = "sum_65536_dark",
                       .what = "65,536 voxels of opacity 3e-8, transmittance",
                       .voxels = 65536,
                       .byte = 254,
                       .dark = true}));
  cases.push_back(sum({.name = "sum_of_samples",
                       .what = "64,000 samples, step 1/64, over 1000 voxels, transmittance",
                       .voxels = 1000,
                       .byte = 254,
                       .dark = true,
                       .filters = {Filter::linear},
                       .step = kMinStep}));
  cases.push_back(sum({.name = "one_voxel_cancels", .what = "one voxel of optical depth 0.002", .voxels = 1}));
  cases.push_back(sum({.name = "one_voxel_cancels_dark",
                       .what = "one voxel of optical depth 0.002, transmittance",
                       .voxels = 1,
                       .byte = 254,
                       .dark = true}));
  cases.push_back(sum({.name = "one_voxel_dense", .what = "one voxel of optical depth 6.2", .voxels = 1, .byte = 254}));
}

}  // namespace

std::vector<Case> depthCases() {
  std::vector<Case> cases;
  for (int exponent : {-12, -6, -3, 0, 3, 6, 9, 12}) cases.push_back(uniform(exponent));
  const glm::dvec3 blue(0.1, 0.3, 1);
  cases.push_back(
      wall("wall_1e9_behind_1e_9", "a wall of 1e9 a voxel behind 1000 voxels of 1e-9", 1000, 1e3, 1e-9, true, blue));
  cases.push_back(wall("wall_1e12_behind_1e_12", "a wall of 1e12 a voxel behind 1000 voxels of 1e-12", 1000, 1e6, 1e-12,
                       true, blue));
  cases.push_back(
      wall("wall_1e9_behind_1e_3", "a wall of 1e9 a voxel behind 1000 voxels of 1e-3", 1000, 1e3, 1e-3, true, blue));
  cases.push_back(
      wall("wall_1e12_before", "a wall of 1e12 a voxel before 1000 voxels of 1e-3", 1000, 1e6, 1e-3, false, blue));
  addSums(cases);
  cases.push_back({"haze_over_nothing", "opacities about 0.01 over a transparent background", [] {
                     Scenario scenario{.source = clumps(VoxelType::rgba8, {30, 28, 26}),
                                       .view = look(glm::dmat4(1), {50, 40, 70}, {15, 14, 13})};
                     scenario.view.extinction = 0.002;
                     scenario.view.background = {0, 0, 0, 0};
                     return imageError(scenario);
                   }});
  return cases;
}

}  // namespace blockwalk::extreme
