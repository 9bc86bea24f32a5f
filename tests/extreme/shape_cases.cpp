// SPDX-License-Identifier: Apache-2.0
// Volumes of one voxel, of one row, of one block and one voxel more; spacing and maps at the ends of what is sensible.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>

#include "tests/extreme/cases.h"
#include "tests/extreme/gauge.h"
#include "tests/extreme/volumes.h"

namespace blockwalk::extreme {
namespace {

// A look at the whole, from aside.
View aside(const glm::dmat4& map, glm::ivec3 dims) {
  const glm::dvec3 middle = 0.5 * glm::dvec3(dims);
  const glm::dvec3 center(map * glm::dvec4(middle, 1));
  double radius = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 place = glm::dvec3(dims) * glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2);
    radius = std::max(radius, glm::length(glm::dvec3(map * glm::dvec4(place, 1)) - center));
  }
  View view = look(map, middle, middle);
  view.eye = center + 2.2 * radius * glm::normalize(glm::dvec3(0.5, 0.6, 0.8));
  view.up = glm::dvec3(0.1, 1, 0.2);
  view.fov_degrees = 50;
  return view;
}

Case shaped(std::string name, std::string what, glm::ivec3 dims, const glm::dmat4& map = glm::dmat4(1)) {
  return {std::move(name), std::move(what), [=] {
            Scenario scenario{.source = clumps(VoxelType::rgba8, dims, map), .view = aside(map, dims)};
            scenario.view.channels[0].range = DensityRange{.lo = 60, .hi = 255};
            return imageError(scenario);
          }};
}

// Voxels much longer one way than another, seen by parallel rays that cross as many faces along each axis: `toward` and
// `up` in index space. `longest`: a voxel's longest side in unit distances.
Case stretched(std::string name, std::string what, glm::dvec3 voxel, glm::dvec3 toward, glm::dvec3 up, double longest) {
  return {std::move(name), std::move(what), [=] {
            const glm::ivec3 dims(34, 30, 26);
            const glm::dmat4 map = spacing(voxel);
            const glm::dvec3 middle = 0.5 * glm::dvec3(dims);
            Scenario scenario{.source = clumps(VoxelType::rgba8, dims, map),
                              .view = lookStraight(map, middle + toward, middle, up, 2)};
            scenario.view.channels[0].range = DensityRange{.lo = 60, .hi = 255};
            scenario.view.extinction = 0.2 / longest;
            return imageError(scenario);
          }};
}

// A bar along an axis with a density that changes all the time, seen by 2x4 parallel rays; `extinction` small enough to
// see its far end where the rays run along it.
Case bar(std::string name, std::string what, int axis, glm::dvec3 eye, glm::dvec3 target, double extinction) {
  return {std::move(name), std::move(what), [=] {
            glm::ivec3 dims(1);
            dims[axis] = 65536;
            const Density density = [](glm::ivec3 v) { return std::floor(256 * static_cast<float>(noise(v))); };
            glm::dvec3 up(0);
            up[(axis + 1) % 3] = 1;
            Scenario scenario{.source = fill(VoxelType::rgba8, dims, density),
                              .view = lookStraight(glm::dmat4(1), eye, target, up, 0.2)};
            scenario.view.width = 2;
            scenario.view.height = 4;
            scenario.view.channels[0].range = DensityRange{.lo = 60, .hi = 255};
            scenario.view.extinction = extinction;
            return imageError(scenario);
          }};
}

void addDims(std::vector<Case>& cases) {
  cases.push_back({"one_voxel", "a volume of one voxel", [] {
                     return imageError(
                         {.source = fill(VoxelType::rgba8, glm::ivec3(1), [](glm::ivec3) { return 200.0f; }),
                          .view = aside(glm::dmat4(1), glm::ivec3(1))});
                   }});
  cases.push_back(shaped("one_block", "one block, 48 voxels each way", glm::ivec3(48)));
  cases.push_back(shaped("one_voxel_more", "49 voxels each way: eight blocks and a level more", glm::ivec3(49)));
  cases.push_back(shaped("one_full_level_more", "96 voxels each way: two full levels", glm::ivec3(96)));
  cases.push_back(shaped("one_slice", "a slice of 100x100x1", {100, 100, 1}));
  cases.push_back({"coarsest_level", "97 voxels each way, drawn at the coarsest of three levels", [] {
                     Scenario scenario{.source = clumps(VoxelType::rgba8, glm::ivec3(97)),
                                       .view = aside(glm::dmat4(1), glm::ivec3(97))};
                     scenario.view.level = 2;
                     scenario.view.channels[0].range = DensityRange{.lo = 60, .hi = 255};
                     return imageError(scenario);
                   }});
  cases.push_back(
      bar("bar_65536_along", "1x1x65536, parallel rays along it", 2, {0.5, 0.5, 70000}, {0.5, 0.5, 0}, 2e-5));
  cases.push_back(bar("bar_65536_leaning", "1x1x65536, rays that leave it after half its length", 2, {1.3, 0.6, 70000},
                      {0.5, 0.5, 5000}, 2e-5));
  cases.push_back(bar("bar_65536_across", "65536x1x1, parallel rays across its far end", 0, {65530.2, 20, 9},
                      {65530.2, 0.5, 0.5}, 2));
}

Case meanOfBar() {
  return {"mean_of_65536", "the mean of 65,536 values, 1x1x65536, u16", [] {
            Scenario scenario{
                .source = fill(VoxelType::u16, {1, 1, 65536},
                               [](glm::ivec3 v) { return static_cast<float>(1 + std::floor(65000 * noise(v))); }),
                .view = lookStraight(glm::dmat4(1), {0.5, 0.5, 70000}, {0.5, 0.5, 0}, {0, 1, 0}, 0.2)};
            scenario.view.width = scenario.view.height = 4;
            scenario.view.mode = Mode::mean;
            scenario.view.channels[0].transfer = ramp(32300, 32700, 0.5);  // 255 steps over 0.6% of the domain
            return imageError(scenario);
          }};
}

void addMaps(std::vector<Case>& cases) {
  const glm::ivec3 dims(34, 30, 26);
  cases.push_back(stretched("spacing_1_1_1000", "spacing 1:1:1000", {1, 1, 1000}, {18, 15, 40}, {0, 1, 0}, 1000));
  cases.push_back(stretched("spacing_1000_1_1", "spacing 1000:1:1", {1000, 1, 1}, {-40, 15, 18}, {0, 1, 0}, 1000));
  cases.push_back(shaped("spacing_1e_9", "voxels of 1e-9 m", dims, spacing(glm::dvec3(1e-9))));
  cases.push_back(shaped("spacing_1e9", "voxels of 1e9 m", dims, spacing(glm::dvec3(1e9))));
  cases.push_back(shaped("spacing_1e_25", "voxels of 1e-25 m", dims, spacing(glm::dvec3(1e-25))));
  cases.push_back(shaped("spacing_1e25", "voxels of 1e25 m", dims, spacing(glm::dvec3(1e25))));
  cases.push_back(stretched("spacing_mixed", "spacing 1e-3:1:1e3", {1e-3, 1, 1e3}, {18, 15, 40}, {1, 0, 0}, 1e6));
  cases.push_back(shaped("rotated", "a map with an oblique rotation", dims, test::obliqueMap(false)));
  cases.push_back(shaped("mirrored", "a map that mirrors and rotates", dims, test::obliqueMap(true)));
  glm::dmat4 sheared(1);
  sheared[1][0] = 0.99;
  cases.push_back(shaped("sheared", "axes 45 degrees apart", dims, sheared));
  cases.push_back(shaped("origin_1e9", "the volume's origin 1e9 voxels from the world's", dims,
                         glm::translate(glm::dmat4(1), glm::dvec3(1e9, -1e9, 1e9))));
}

// u8, all 0 but one voxel.
class Lonely : public Source {
 public:
  Lonely(glm::ivec3 dims, glm::ivec3 voxel) : voxel_(voxel) {
    info_ = {.name = "lonely", .format = "demo", .type = VoxelType::u8, .dims = dims, .random_access = true};
  }
  const SourceInfo& info() const override { return info_; }
  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    std::ranges::fill(out, std::byte{0});
    if (z != voxel_.z || voxel_.y < y || voxel_.y >= y + count) return;
    const auto row = static_cast<std::size_t>(voxel_.y - y);
    out[row * static_cast<std::size_t>(info_.dims.x) + static_cast<std::size_t>(voxel_.x)] = std::byte{200};
  }

 private:
  SourceInfo info_;
  glm::ivec3 voxel_;
};

// The last voxel of a huge index space, all else empty, seen from near it along a diagonal.
Case corner(glm::ivec3 dims) {
  const glm::ivec3 voxel = dims - 1;
  return {fmt::format("corner_of_{}_{}_{}", dims.x, dims.y, dims.z),
          fmt::format("one voxel in the far corner of {}x{}x{}", dims.x, dims.y, dims.z), [=] {
            const glm::dvec3 middle = glm::dvec3(voxel) + 0.5;
            auto alone = std::make_shared<reference::DenseVolume>(reference::emptyVolume(VoxelType::u8, glm::ivec3(1)));
            alone->density[0] = 200;
            alone->world_from_index = glm::translate(glm::dmat4(1), glm::dvec3(voxel));
            reference::deriveBlocks(*alone, alone->block_voxels);
            Scenario scenario{.source = std::make_shared<Lonely>(dims, voxel),
                              .view = look(glm::dmat4(1), middle + glm::dvec3(3, 4, 6), middle),
                              .filters = {Filter::nearest},
                              .reference = alone};
            scenario.view.channels[0].transfer = white(0.7);
            return imageError(scenario);
          }};
}

}  // namespace

std::vector<Case> shapeCases() {
  std::vector<Case> cases;
  addDims(cases);
  cases.push_back(meanOfBar());
  addMaps(cases);
  cases.push_back({"small_blocks", "blocks of 2 subblocks of 4 voxels", [] {
                     Scenario scenario{.source = clumps(VoxelType::rgba8, {56, 54, 52}),
                                       .view = aside(glm::dmat4(1), {56, 54, 52})};
                     scenario.view.channels[0].range = DensityRange{.lo = 60, .hi = 255};
                     scenario.build.subblock_side = 4;
                     scenario.build.block_side = 2;
                     return imageError(scenario);
                   }});
  for (const glm::ivec3& dims :
       {glm::ivec3(32768, 32768, 1), {1, 32768, 32768}, {32768, 1, 32768}, {65536, 8, 8}, {1024, 512, 1024}}) {
    cases.push_back(corner(dims));
  }
  return cases;
}

}  // namespace blockwalk::extreme
