// SPDX-License-Identifier: Apache-2.0
// `cells`: fluorescent cells in a dish: bright membranes, nuclei with nucleoli, organelles in a faint cytoplasm (u16).
#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "volume/demo/model.h"
#include "volume/demo/noise.h"

namespace blockwalk {
namespace {

struct Cell {
  glm::dvec3 center{0};
  glm::dvec3 radii{0};
  glm::dmat3 frame{1.0};
  glm::dvec3 nucleus{0};  // in the cell's frame, over its radii
  double reach = 0;
  double brightness = 1;
  std::uint32_t seed = 0;
};

class Cells final : public DemoModel {
 public:
  explicit Cells(int size) : dims_(demoDims(size, {4, 3, 2})), voxel_(1.0 / size) {
    HashSequence places(515);
    for (int attempt = 0; attempt < 4000 && cells_.size() < 56; ++attempt) addCell(places);
  }

  VoxelType type() const override { return VoxelType::u16; }
  glm::ivec3 dims() const override { return dims_; }

  void writeRow(int y, int z, std::span<std::byte> out) override {
    glm::dvec3 point(0, (y + 0.5) * voxel_, (z + 0.5) * voxel_);
    for (const Cell& cell : cells_) {
      const glm::dvec3 off = glm::abs(point - cell.center);
      if (off.y > cell.reach || off.z > cell.reach) continue;
      const int first = static_cast<int>(std::floor((cell.center.x - cell.reach) / voxel_));
      const int last = static_cast<int>(std::floor((cell.center.x + cell.reach) / voxel_));
      for (int x = std::max(first, 0); x <= std::min(last, dims_.x - 1); ++x) {
        point.x = (x + 0.5) * voxel_;
        const double value = at(cell, point);
        if (value <= 0) continue;
        const double shot = 0.9 + 0.2 * hashUnit(hashCell(x, y, z, 21));
        const auto bright = static_cast<std::uint16_t>(std::min(40000.0, value * shot));
        std::uint16_t before = 0;
        std::memcpy(&before, &out[static_cast<std::size_t>(x) * 2], 2);
        const std::uint16_t after = std::max(before, bright);
        std::memcpy(&out[static_cast<std::size_t>(x) * 2], &after, 2);
      }
    }
  }

 private:
  // Cells may touch and do not run through each other.
  void addCell(HashSequence& places) {
    Cell cell;
    cell.radii = {places.between(0.055, 0.095), places.between(0.05, 0.075), places.between(0.04, 0.06)};
    cell.reach = 1.12 * cell.radii.x;
    cell.center = {places.between(0.09, 0.91), places.between(0.09, 0.66), places.between(0.08, 0.42)};
    const glm::dvec3 normal{places.between(-0.4, 0.4), places.between(-0.4, 0.4), 1.0};
    cell.frame = frameAround(normal, places.unit());
    cell.nucleus = {places.between(-0.22, 0.22), places.between(-0.2, 0.2), places.between(-0.15, 0.15)};
    cell.brightness = places.between(0.7, 1.15);
    cell.seed = places.bits();
    for (const Cell& other : cells_) {
      if (glm::length(cell.center - other.center) < 0.78 * (cell.radii.y + other.radii.y)) return;
    }
    cells_.push_back(cell);
  }

  double at(const Cell& cell, glm::dvec3 point) {
    const glm::dvec3 d = point - cell.center;
    const glm::dvec3 q =
        glm::dvec3(glm::dot(cell.frame[0], d), glm::dot(cell.frame[1], d), glm::dot(cell.frame[2], d)) / cell.radii;
    const double r2 = glm::dot(q, q);
    if (r2 > 1.25) return 0;
    const double ruffle = ruffle_.at(point * 34.0);
    const double radius = std::sqrt(r2) * (0.93 + 0.14 * ruffle);
    if (radius > 1) return 0;
    const double membrane = std::max(0.05, 1.3 * voxel_ / cell.radii.z);
    if (radius > 1 - membrane) return cell.brightness * (15000 + 9000 * ruffle);

    const double nucleus = glm::length((q - cell.nucleus) / glm::dvec3(0.40, 0.42, 0.46)) * (0.95 + 0.1 * ruffle);
    if (nucleus < 1) return cell.brightness * nucleusAt(cell, point, nucleus);
    const double organelle = organelleAt(cell, point);
    if (organelle > 0) return cell.brightness * organelle;
    return cell.brightness * (700 + 1900 * mesh_.at(point * 150.0));
  }

  double nucleusAt(const Cell& cell, glm::dvec3 point, double radius) {
    if (radius > 0.9) return 23000;
    const double chromatin = chromatin_.at(point * 120.0 + hashUnit(cell.seed) * 100);
    if (radius < 0.62 && chromatin > 0.66) return 37000;
    return 7000 + 15000 * smoothStep(0.3, 0.7, chromatin);
  }

  // One vesicle in about every third cell of a fine lattice; long thin ones are mitochondria.
  double organelleAt(const Cell& cell, glm::dvec3 point) {
    constexpr double kLattice = 95;
    const glm::dvec3 p = point * kLattice;
    const glm::ivec3 c(glm::floor(p));
    const std::uint32_t h = hashCell(c.x, c.y, c.z, cell.seed);
    const double choice = hashUnit(h);
    if (choice > 0.34) return 0;
    const glm::dvec3 center(0.35 + 0.3 * hashUnit(hashBits(h + 1)), 0.35 + 0.3 * hashUnit(hashBits(h + 2)),
                            0.35 + 0.3 * hashUnit(hashBits(h + 3)));
    glm::dvec3 d = p - glm::dvec3(c) - center;
    if (choice < 0.15) d[static_cast<int>(h % 3)] *= 0.45;
    const double distance = glm::length(d) / 0.24;
    if (distance > 1) return 0;
    return (choice < 0.15 ? 12000 : 29000) * (1 - 0.5 * distance * distance);
  }

  glm::ivec3 dims_;
  double voxel_;
  std::vector<Cell> cells_;
  Noise ruffle_{111};
  Noise mesh_{121};
  FractalNoise chromatin_{131, 2};
};

}  // namespace

std::unique_ptr<DemoModel> makeCells(int size) { return std::make_unique<Cells>(size); }

}  // namespace blockwalk
