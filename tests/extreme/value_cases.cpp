// SPDX-License-Identifier: Apache-2.0
// Densities at the ends of what a float holds, NaN and infinity, and ranges that select all, one or nothing.
#include <cmath>
#include <limits>

#include "tests/extreme/cases.h"
#include "tests/extreme/gauge.h"
#include "tests/extreme/volumes.h"

namespace blockwalk::extreme {
namespace {

constexpr glm::ivec3 kDims(30, 28, 26);
constexpr float kDenormal = 1e-40f;

// Clumps: one cell of 5 voxels in three is there, with values in (0, 1].
double clump(glm::ivec3 voxel) { return noise(voxel / 5 + 100) < 0.35 ? 0.2 + 0.8 * noise(voxel) : 0; }

View aside() { return look(glm::dmat4(1), {50, 40, 70}, {15, 14, 13}); }

Scenario scalars(const Density& density, std::vector<TransferPoint> transfer, VoxelType type = VoxelType::f32,
                 ValueMap values = {}) {
  Scenario scenario{.source = fill(type, kDims, density, glm::dmat4(1), values), .view = aside()};
  scenario.view.channels[0].transfer = std::move(transfer);
  return scenario;
}

// f32 clumps of values up to `largest`, a ramp over them.
Scenario scaled(double largest) {
  return scalars([=](glm::ivec3 v) { return static_cast<float>(largest * clump(v)); }, ramp(0, largest, 0.3));
}

Case image(std::string name, std::string what, std::function<Scenario()> make) {
  return {std::move(name), std::move(what), [make = std::move(make)] { return imageError(make()); }};
}

Case imageInMode(std::string name, std::string what, Mode mode, std::function<Scenario()> make) {
  return image(std::move(name), std::move(what), [mode, make = std::move(make)] {
    Scenario scenario = make();
    scenario.view.mode = mode;
    return scenario;
  });
}

Scenario bytesInRange(double lo, double hi, bool blank = false) {
  Scenario scenario = scalars([](glm::ivec3 v) { return static_cast<float>(std::floor(255 * clump(v))); },
                              ramp(0, 255, 0.3), VoxelType::u8);
  scenario.view.channels[0].range = DensityRange{.lo = lo, .hi = hi};
  scenario.blank = blank;
  return scenario;
}

void addFloats(std::vector<Case>& cases) {
  cases.push_back(image("values_1e38", "f32 up to 3e38", [] { return scaled(3e38); }));
  cases.push_back(imageInMode("mean_of_1e38", "f32 up to 3e38, their mean", Mode::mean, [] { return scaled(3e38); }));
  cases.push_back(imageInMode("mip_of_1e38", "f32 up to 3e38, the largest", Mode::mip, [] { return scaled(3e38); }));
  cases.push_back(image("values_both_1e38", "f32 from -3e38 to 3e38: their difference is no float", [] {
    Scenario scenario =
        scalars([](glm::ivec3 v) { return clump(v) > 0 ? static_cast<float>(6e38 * (noise(v) - 0.5)) : -3.3e38f; },
                ramp(-3e38, 3e38, 0.3));
    scenario.build.empty_thresholds = {-3.2e38};
    return scenario;
  }));
  cases.push_back(image("values_1e_38", "f32 up to 1e-38, below the least normal float", [] { return scaled(1e-38); }));
  cases.push_back(image("values_1e_40", "f32 up to 1e-40, all denormal", [] { return scaled(kDenormal); }));
  cases.push_back(imageInMode("iso_of_1e_38", "f32 up to 1e-38, the surface of 5e-39", Mode::iso, [] {
    Scenario scenario = scaled(1e-38);
    scenario.view.iso = 5e-39;
    return scenario;
  }));
  cases.push_back(image("values_least", "f32, all 1.4e-45, the least there is", [] {
    return scalars([](glm::ivec3 v) { return clump(v) > 0 ? std::numeric_limits<float>::denorm_min() : 0; },
                   white(0.2));
  }));
  cases.push_back(image("denormals_beside_1", "f32, denormals among values up to 1 that are transparent", [] {
    return scalars(
        [](glm::ivec3 v) { return noise(v) < 0.5 ? static_cast<float>(clump(v)) : (clump(v) > 0 ? kDenormal : 0); },
        ramp(0, 1, 0.3));
  }));
  cases.push_back(image("zero_is_empty", "f32, an opaque transfer function and zeros beside values: zero stays empty",
                        [] { return scalars([](glm::ivec3 v) { return clump(v) > 0.5 ? 1.0f : 0.0f; }, white(0.4)); }));
  cases.push_back(image("nan_and_inf", "f32 with NaN, infinity and minus infinity among the values", [] {
    return scalars(
        [](glm::ivec3 v) {
          constexpr float kInfinity = std::numeric_limits<float>::infinity();
          const double kind = noise(v + 1000);
          if (kind < 0.1) return std::numeric_limits<float>::quiet_NaN();
          if (kind < 0.2) return kind < 0.15 ? kInfinity : -kInfinity;
          return static_cast<float>(clump(v));
        },
        ramp(0, 1, 0.3));
  }));
  cases.push_back(image("all_nan", "f32, nothing but NaN: background", [] {
    Scenario scenario = scalars([](glm::ivec3) { return std::numeric_limits<float>::quiet_NaN(); }, ramp(0, 1, 0.3));
    scenario.blank = true;
    return scenario;
  }));
  cases.push_back(image("values_on_16777216", "f32, whole numbers above 2^24, one float apart", [] {
    Scenario scenario = scalars(
        [](glm::ivec3 v) { return clump(v) > 0 ? 16777216.0f + 2 * std::floor(static_cast<float>(16 * noise(v))) : 0; },
        ramp(16777216, 16777246, 0.3));
    scenario.filters = {Filter::nearest};  // between two neighbouring floats there is nothing to interpolate
    return scenario;
  }));
  cases.push_back(image("values_on_4096", "f32, values of 4096 to 4097: a float has 2048 of them", [] {
    return scalars([](glm::ivec3 v) { return 4096 + static_cast<float>(clump(v)); }, ramp(4096, 4097, 0.3));
  }));
  cases.push_back(image("value_map_1e_30", "u16, data units 1e-30 of a stored one, on 1e-20", [] {
    return scalars([](glm::ivec3 v) { return static_cast<float>(std::floor(65535 * clump(v))); },
                   ramp(1e-20, 1e-20 + 65535e-30, 0.3), VoxelType::u16, {.scale = 1e-30, .offset = 1e-20});
  }));
  cases.push_back(image("value_map_1e30", "f32, data units 1e30 of a stored one: beyond a float", [] {
    Scenario scenario = scalars([](glm::ivec3 v) { return static_cast<float>(1e20 * clump(v)); }, ramp(0, 1e50, 0.3),
                                VoxelType::f32, {.scale = 1e30});
    scenario.view.channels[0].range = DensityRange{.lo = 3e49, .hi = 8e49};
    return scenario;
  }));
}

void addRanges(std::vector<Case>& cases) {
  cases.push_back(image("range_between", "u8, a range between two whole numbers: background", [] {
    Scenario scenario = bytesInRange(100.2, 100.8, true);
    scenario.filters = {Filter::nearest};
    return scenario;
  }));
  cases.push_back(
      image("range_above", "u8, a range above all values: background", [] { return bytesInRange(300, 400, true); }));
  cases.push_back(
      image("range_one_value", "u8, a range of one value", [] { return bytesInRange(255 * 0.6, 255 * 0.6 + 1); }));
  cases.push_back(image("range_type", "u8, the whole domain 0:255", [] { return bytesInRange(0, 255); }));
  cases.push_back(
      image("range_double", "u8, a range from -1e308 to 1e308", [] { return bytesInRange(-1e308, 1e308); }));
  cases.push_back(image("range_floats", "f32, the whole domain of floats", [] {
    Scenario scenario = scaled(1);
    const auto largest = static_cast<double>(std::numeric_limits<float>::max());
    scenario.view.channels[0].range = DensityRange{.lo = -largest, .hi = largest};
    return scenario;
  }));
  cases.push_back(image("range_1e_36", "f32 up to 1, a range of 1e-36", [] {
    Scenario scenario =
        scalars([](glm::ivec3 v) { return static_cast<float>(noise(v + 1000) < 0.5 ? clump(v) : 1e-36 * clump(v)); },
                ramp(0, 1e-36, 0.3));
    scenario.view.channels[0].range = DensityRange{.lo = 0, .hi = 1e-36};
    scenario.filters = {Filter::nearest};
    return scenario;
  }));
  cases.push_back({"range_inverted", "a range whose ends are exchanged: an error",
                   [] { return isNotRefused(bytesInRange(20, 10), "range"); }, Unit::wrong, 0});
  cases.push_back({"range_nan", "a range that ends with NaN: an error",
                   [] { return isNotRefused(bytesInRange(20, std::nan("")), "range"); }, Unit::wrong, 0});
}

}  // namespace

std::vector<Case> valueCases() {
  std::vector<Case> cases;
  addFloats(cases);
  addRanges(cases);
  return cases;
}

}  // namespace blockwalk::extreme
