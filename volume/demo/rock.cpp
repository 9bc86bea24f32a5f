// SPDX-License-Identifier: Apache-2.0
// `rock`: a piece of granite-like rock: mineral grains, pores between them, veins of ore.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "volume/demo/model.h"
#include "volume/demo/noise.h"

namespace blockwalk {
namespace {

struct Mineral {
  double share;  // of the grains, cumulated
  glm::dvec3 color;
  double density;
};
constexpr std::array<Mineral, 6> kMinerals = {{
    {0.34, {206, 198, 188}, 92},   // quartz
    {0.60, {204, 146, 122}, 104},  // potassium feldspar
    {0.78, {224, 216, 196}, 112},  // plagioclase
    {0.91, {52, 48, 50}, 148},     // biotite
    {0.97, {96, 128, 84}, 176},    // epidote
    {1.00, {226, 184, 84}, 238},   // pyrite
}};

class Rock final : public DemoModel {
 public:
  explicit Rock(int size) : dims_(demoDims(size, {1425, 950, 1208})), voxel_(1.0 / size) {
    shape_ = glm::dvec3(1425.0, 950.0, 1208.0) / 1425.0;
  }

  VoxelType type() const override { return VoxelType::rgba8; }
  glm::ivec3 dims() const override { return dims_; }

  void writeRow(int y, int z, std::span<std::byte> out) override {
    for (int x = 0; x < dims_.x; ++x) {
      const glm::dvec3 point = (glm::dvec3(x, y, z) + 0.5) * voxel_;
      if (depth(point) <= 0) continue;
      const double pore = pore_.at(point * 21.0);
      if (pore > 0.655) continue;
      const double vein = std::fabs(vein_.at(point * 4.5) - 0.5);
      Matter matter;
      if (vein < 0.012) {
        const double shine = hashUnit(hashCell(x, y, z, 3));
        matter = {glm::dvec3(232, 196, 112) * (0.75 + 0.3 * shine), 205 + 40 * shine};
      } else {
        matter = grainAt(point, {x, y, z});
      }
      // Weathered walls of pores are darker and a little less dense.
      const double wall = smoothStep(0.60, 0.655, pore);
      matter.color *= 1 - 0.35 * wall;
      matter.density *= 1 - 0.25 * wall;
      writeMatter(matter, &out[static_cast<std::size_t>(x) * 4]);
    }
  }

 private:
  double depth(glm::dvec3 point) {
    const glm::dvec3 p = glm::abs(point - shape_ * 0.5) / (shape_ * 0.5);
    const glm::dvec3 p2 = p * p;
    // between a box and an ellipsoid: |p|_4 < 1
    const double radius = std::sqrt(std::sqrt(glm::dot(p2, p2)));
    constexpr double kRelief = 0.16;
    const double inside = 0.94 - kRelief / 2 - radius;
    if (inside > kRelief || inside < -kRelief) return inside;
    return inside + kRelief * (2 * surface_.at(point * 5.0) - 1);
  }

  // Grains are the cells around jittered lattice points (Worley 1996), their borders roughened by noise.
  Matter grainAt(glm::dvec3 point, glm::ivec3 index) {
    constexpr double kGrains = 26;  // along the longest axis
    const double rough = rough_.at(point * 70.0);
    const glm::dvec3 p = point * kGrains + 0.22 * (rough - 0.5);
    if (glm::ivec3(glm::floor(p)) != cell_) gatherGrains(p);
    double nearest = std::numeric_limits<double>::max();
    double second = nearest;
    std::uint32_t grain = 0;
    for (const Grain& candidate : grains_) {
      const glm::dvec3 d = p - candidate.center;
      const double distance = glm::dot(d, d);
      if (distance < nearest) {
        second = nearest;
        nearest = distance;
        grain = candidate.identity;
      } else if (distance < second) {
        second = distance;
      }
    }
    const double choice = hashUnit(grain);
    std::size_t kind = 0;
    while (kMinerals[kind].share < choice) ++kind;
    const double tint = hashUnit(hashBits(grain + 1));
    const double border = smoothStep(0.0, 0.14, std::sqrt(second) - std::sqrt(nearest));
    const double speck = hashUnit(hashCell(index.x, index.y, index.z, 6));
    const glm::dvec3 color =
        kMinerals[kind].color * ((0.80 + 0.24 * tint) * (0.62 + 0.38 * border) * (0.94 + 0.08 * speck));
    return {color, kMinerals[kind].density * (0.90 + 0.10 * border) + 10 * tint + 6 * speck};
  }

  struct Grain {
    glm::dvec3 center{0};
    std::uint32_t identity = 0;
  };

  void gatherGrains(glm::dvec3 p) {
    cell_ = glm::ivec3(glm::floor(p));
    for (int i = 0; i < 27; ++i) {
      const glm::ivec3 c = cell_ + glm::ivec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
      const std::uint32_t h = hashCell(c.x, c.y, c.z, 12);
      const glm::dvec3 jitter(hashUnit(h), hashUnit(hashBits(h + 2)), hashUnit(hashBits(h + 3)));
      grains_[static_cast<std::size_t>(i)] = {glm::dvec3(c) + jitter, hashBits(h + 4)};
    }
  }

  glm::ivec3 dims_;
  double voxel_;
  glm::dvec3 shape_{1};
  FractalNoise surface_{61, 5};
  FractalNoise pore_{71, 2};
  FractalNoise vein_{81, 3};
  Noise rough_{91};
  std::array<Grain, 27> grains_{};
  glm::ivec3 cell_{INT32_MIN};
};

}  // namespace

std::unique_ptr<DemoModel> makeRock(int size) { return std::make_unique<Rock>(size); }

}  // namespace blockwalk
