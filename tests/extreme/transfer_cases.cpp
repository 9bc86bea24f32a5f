// SPDX-License-Identifier: Apache-2.0
// Transfer functions with steps, spikes narrower than a sample's step or a table's entry, nothing and everything.
#include <cmath>

#include "tests/extreme/cases.h"
#include "tests/extreme/gauge.h"
#include "tests/extreme/volumes.h"

namespace blockwalk::extreme {
namespace {

constexpr glm::ivec3 kDims(30, 28, 26);

// A smooth field from 0 to `largest`: shells round a point aside.
Density shells(double largest) {
  return [=](glm::ivec3 v) {
    const double radius = glm::length(glm::dvec3(v) - glm::dvec3(5.3, 9.1, 12.2));
    return static_cast<float>(std::round(largest * (0.5 + 0.5 * std::cos(radius / 3))));
  };
}

struct Look {
  VoxelType type = VoxelType::u8;
  std::vector<Filter> filters{Filter::nearest, Filter::linear};
  Classification classification = Classification::post;
  TransferShape shape = TransferShape::linear;
  double step = 0.5;
  bool blank = false;
};

Case shown(std::string name, std::string what, std::vector<TransferPoint> transfer, const Look& how = {}) {
  return {std::move(name), std::move(what), [=] {
            const double largest = how.type == VoxelType::u8 ? 255 : 65535;
            Scenario scenario{.source = fill(how.type, kDims, shells(largest)),
                              .view = look(glm::dmat4(1), {50, 40, 70}, {15, 14, 13}),
                              .filters = how.filters,
                              .blank = how.blank};
            scenario.view.channels[0].transfer = transfer;
            scenario.view.transfer_shape = how.shape;
            scenario.view.classification = how.classification;
            scenario.view.step = how.step;
            return imageError(scenario);
          }};
}

// Opacity between `lo` and `hi` alone.
std::vector<TransferPoint> spike(double lo, double hi, double opacity) {
  const glm::dvec3 red(1, 0.2, 0.1);
  return {{.value = lo, .color = red, .opacity = 0},
          {.value = (lo + hi) / 2, .color = red, .opacity = opacity},
          {.value = hi, .color = red, .opacity = 0}};
}

std::vector<TransferPoint> stepAt(double value, double width, double opacity) {
  return {{.value = value, .color = {0, 0.2, 0.9}, .opacity = 0},
          {.value = value + width, .color = {1, 0.7, 0.2}, .opacity = opacity}};
}

const std::vector<Filter> kLinear{Filter::linear};
constexpr Classification kPre = Classification::pre_integrated;

}  // namespace

std::vector<Case> transferCases() {
  std::vector<Case> cases;
  cases.push_back(shown("step", "u8, a step of opacity 1e-6 wide between two whole numbers", stepAt(127.4, 1e-6, 0.6),
                        {.filters = {Filter::nearest}}));
  cases.push_back(shown("step_linear", "u8, a step 2 wide, smooth field", stepAt(127, 2, 0.6), {.filters = kLinear}));
  cases.push_back(shown("step_pre_integrated", "u8, a step 1e-6 wide, pre-integrated", stepAt(127.4, 1e-6, 0.6),
                        {.filters = kLinear, .classification = kPre, .step = 1}));
  cases.push_back(shown("stepped", "u8, three steps at whole numbers",
                        {{.value = 0, .color = {0, 0, 0}, .opacity = 0},
                         {.value = 80, .color = {0.9, 0.1, 0.1}, .opacity = 0.3},
                         {.value = 160, .color = {0.1, 0.9, 0.1}, .opacity = 0},
                         {.value = 200, .color = {0.1, 0.1, 0.9}, .opacity = 0.8}},
                        {.filters = {Filter::nearest}, .shape = TransferShape::stepped}));
  cases.push_back(shown("spike_at_value", "u8, a spike 1e-3 wide at one whole number", spike(127.9995, 128.0005, 0.9),
                        {.filters = {Filter::nearest}}));
  cases.push_back(shown("spike_post", "u8, a spike 0.5 wide, samples 2 voxels apart, post-classified",
                        spike(127.75, 128.25, 0.9), {.filters = kLinear, .step = 2}));
  cases.push_back(shown("spike_pre_integrated", "the same, pre-integrated", spike(127.75, 128.25, 0.9),
                        {.filters = kLinear, .classification = kPre, .step = 2}));
  cases.push_back(shown("spike_on_ramp",
                        "u8, a spike 0.01 wide on a ramp: narrower than an entry of the table, pre-integrated",
                        {{.value = 0, .color = {0, 0, 0}, .opacity = 0},
                         {.value = 127.995, .color = {0, 0, 1}, .opacity = 0.01},
                         {.value = 128, .color = {1, 0, 0}, .opacity = 0.999},
                         {.value = 128.005, .color = {0, 0, 1}, .opacity = 0.01},
                         {.value = 255, .color = {0, 0, 1}, .opacity = 0.02}},
                        {.filters = kLinear, .classification = kPre, .step = 1}));
  cases.push_back(shown("spike_u16", "u16, a spike 2 of 65536 wide on a ramp, pre-integrated",
                        {{.value = 0, .color = {0, 0, 0}, .opacity = 0},
                         {.value = 30000, .color = {0, 0, 1}, .opacity = 0.01},
                         {.value = 30001, .color = {1, 0, 0}, .opacity = 0.9999},
                         {.value = 30002, .color = {0, 0, 1}, .opacity = 0.01},
                         {.value = 65535, .color = {0, 0, 1}, .opacity = 0.02}},
                        {.type = VoxelType::u16, .filters = kLinear, .classification = kPre, .step = 1}));
  cases.push_back(shown("all_zero", "u8, opacity 0 everywhere: background", white(0), {.blank = true}));
  cases.push_back(shown("all_zero_pre_integrated", "the same, pre-integrated", white(0),
                        {.filters = kLinear, .classification = kPre, .blank = true}));
  cases.push_back(shown("all_one", "u8, opacity 1 everywhere", white(1)));
  cases.push_back(shown("all_one_pre_integrated", "the same, pre-integrated", white(1),
                        {.filters = kLinear, .classification = kPre}));
  cases.push_back(shown("opacity_1e_300", "u8, opacity 1e-300 everywhere: background", white(1e-300), {.blank = true}));
  cases.push_back(shown("opacity_below_1", "u8, opacity 1 - 1e-16 everywhere", white(1 - 1e-16)));
  cases.push_back(shown(
      "points_1e300", "u8, points at -1e300 and 1e300",
      {{.value = -1e300, .color = {1, 0, 0}, .opacity = 0.1}, {.value = 1e300, .color = {0, 0, 1}, .opacity = 0.3}}));
  cases.push_back(
      shown("points_1e_13_apart", "u8, points 1e-13 apart", stepAt(100, 1e-13, 0.5), {.filters = {Filter::nearest}}));
  return cases;
}

}  // namespace blockwalk::extreme
