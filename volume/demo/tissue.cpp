// SPDX-License-Identifier: Apache-2.0
// `tissue`: hollow balls of cells as a confocal microscope sees them, a dye a channel: nuclei, membranes, and a marker
// that a few of the cells carry (u16).
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "volume/demo/model.h"
#include "volume/demo/noise.h"

namespace blockwalk {
namespace {

constexpr double kLattice = 34;  // about as many cells along the longest axis
enum Channel : std::size_t { nuclei, membranes, marker };

struct Ball {
  glm::dvec3 center{0};
  double radius = 0;
};

// A cell is what lies nearest to its seed; seeds are scattered over a lattice, one each. Lengths in lattice steps.
struct Seeds {
  glm::ivec3 nearest{0};
  glm::dvec3 place{0};
  double distance = 0;
  double second = 0;  // to the seed after the nearest
};

class Tissue final : public DemoModel {
 public:
  explicit Tissue(int size) : dims_(demoDims(size, {4, 4, 3})), voxel_(1.0 / size) {
    HashSequence places(733);
    for (int attempt = 0; attempt < 2000 && balls_.size() < 8; ++attempt) addBall(places);
  }

  VoxelType type() const override { return VoxelType::u16; }
  glm::ivec3 dims() const override { return dims_; }
  std::vector<std::string> channels() const override { return {"nuclei", "membranes", "marker"}; }

  void writeRow(int y, int z, std::span<std::byte> out) override {
    glm::dvec3 point(0, (y + 0.5) * voxel_, (z + 0.5) * voxel_);
    for (const Ball& ball : balls_) {
      const double reach = ball.radius + 1.5 / kLattice;  // cells at its rim stand out
      const glm::dvec3 off = glm::abs(point - ball.center);
      if (off.y > reach || off.z > reach) continue;
      const int first = static_cast<int>(std::floor((ball.center.x - reach) / voxel_));
      const int last = static_cast<int>(std::floor((ball.center.x + reach) / voxel_));
      for (int x = std::max(first, 0); x <= std::min(last, dims_.x - 1); ++x) {
        point.x = (x + 0.5) * voxel_;
        const glm::dvec3 from_center = point - ball.center;
        if (glm::dot(from_center, from_center) > reach * reach) continue;
        write(x, lightAt(ball, point), hashUnit(hashCell(x, y, z, 29)), out);
      }
    }
  }

 private:
  using Light = std::array<double, 3>;  // by Channel

  // Balls do not touch: a cell reaches at most one lattice step beyond its ball.
  void addBall(HashSequence& places) {
    Ball ball;
    ball.radius = places.between(0.1, 0.19);
    ball.center = {places.between(0.16, 0.84), places.between(0.16, 0.84), places.between(0.16, 0.59)};
    for (const Ball& other : balls_) {
      if (glm::length(ball.center - other.center) < ball.radius + other.radius + 2.5 / kLattice) return;
    }
    balls_.push_back(ball);
  }

  static Seeds seedsAround(glm::dvec3 p) {
    const glm::ivec3 base(glm::floor(p));
    Seeds seeds;
    double least = std::numeric_limits<double>::max();
    double second = least;
    for (int i = 0; i < 27; ++i) {
      const glm::ivec3 cell = base + glm::ivec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
      const std::uint32_t hash = hashCell(cell.x, cell.y, cell.z, 41);
      const glm::dvec3 place =
          glm::dvec3(cell) + 0.5 +
          0.7 * (glm::dvec3(hashUnit(hash), hashUnit(hashBits(hash + 1)), hashUnit(hashBits(hash + 2))) - 0.5);
      const glm::dvec3 d = p - place;
      const double squared = glm::dot(d, d);
      if (squared < least) {
        second = least;
        least = squared;
        seeds.nearest = cell;
        seeds.place = place;
      } else if (squared < second) {
        second = squared;
      }
    }
    seeds.distance = std::sqrt(least);
    seeds.second = std::sqrt(second);
    return seeds;
  }

  Light lightAt(const Ball& ball, glm::dvec3 point) {
    const Seeds seeds = seedsAround(point * kLattice);
    const double height = glm::length(seeds.place / kLattice - ball.center) / ball.radius;
    if (height > 1 || height < 0.5) return {};  // outside, or the hollow inside
    Light light{};
    const std::uint32_t cell = hashCell(seeds.nearest.x, seeds.nearest.y, seeds.nearest.z, 53);
    const double ruffle = ruffle_.at(point * 60.0);
    const double half_width = std::max(0.03, 0.5 * voxel_ * kLattice);
    const bool at_membrane = seeds.second - seeds.distance < 2 * half_width;
    if (at_membrane) light[membranes] = 6000 + 9000 * ruffle;
    const double nucleus = seeds.distance * (0.9 + 0.2 * ruffle) / 0.36;
    if (nucleus < 1) {
      const double chromatin = chromatin_.at(point * 170.0);
      light[nuclei] = (5000 + 15000 * smoothStep(0.3, 0.7, chromatin)) * (0.7 + 0.6 * hashUnit(hashBits(cell + 1)));
    } else if (!at_membrane && hashUnit(cell) < 0.12) {
      const double grain = grain_.at(point * 210.0);
      if (grain > 0.4) light[marker] = 2000 + 26000 * smoothStep(0.4, 0.8, grain);
    }
    return light;
  }

  // `shot` is the shot noise of this voxel, 0..1.
  void write(int x, const Light& light, double shot, std::span<std::byte> out) const {
    for (std::size_t channel = 0; channel < light.size(); ++channel) {
      if (light[channel] <= 0) continue;
      const auto value = static_cast<std::uint16_t>(std::min(60000.0, light[channel] * (0.85 + 0.3 * shot)));
      const std::size_t at = channel * static_cast<std::size_t>(dims_.x) + static_cast<std::size_t>(x);
      std::memcpy(&out[at * sizeof value], &value, sizeof value);
    }
  }

  glm::ivec3 dims_;
  double voxel_;
  std::vector<Ball> balls_;
  Noise ruffle_{211};
  Noise grain_{221};
  FractalNoise chromatin_{231, 2};
};

}  // namespace

std::unique_ptr<DemoModel> makeTissue(int size) { return std::make_unique<Tissue>(size); }

}  // namespace blockwalk
