// SPDX-License-Identifier: Apache-2.0
// `fossil`: ammonites and sea lilies in a block of layered limestone, in part laid bare.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "volume/demo/ammonite.h"
#include "volume/demo/model.h"
#include "volume/demo/noise.h"

namespace blockwalk {
namespace {

// A sea lily's stem: a stack of discs around a canal.
struct Stem {
  glm::dvec3 from{0};
  glm::dvec3 along{0};  // unit
  double length = 0;
  double radius = 0;
  double disc = 0;  // height of one

  std::optional<Matter> at(glm::dvec3 point) const {
    const glm::dvec3 d = point - from;
    const double t = glm::dot(d, along);
    if (t < 0 || t > length) return std::nullopt;
    const double r = glm::length(d - along * t) / radius;
    const double phase = t / disc - std::floor(t / disc);
    const double rim = 1 - 0.16 * smoothStep(0.25, 0.5, std::fabs(phase - 0.5));
    if (r > rim || r < 0.17) return std::nullopt;
    const double ring = 0.5 + 0.5 * wave(r * 4);
    return Matter{glm::dvec3(214, 196, 168) * (0.72 + 0.2 * rim + 0.1 * ring), 186 + 24 * rim + 10 * ring};
  }
};

class Fossil final : public DemoModel {
 public:
  explicit Fossil(int size) : dims_(demoDims(size, {2172, 1448, 1020})), voxel_(1.0 / size) {
    shape_ = glm::dvec3(1448.0, 1448.0, 1020.0) / 2172.0;
    shape_.x = 1;
    addAmmonite({0.46, 0.335, 0.235}, 0.285, frameAround({0.36, 0.3, 1}, 0.06), 40);
    addAmmonite({0.855, 0.475, 0.285}, 0.098, frameAround({0.7, 0.6, 0.5}, 0.4), 30);
    addAmmonite({0.845, 0.165, 0.215}, 0.066, frameAround({-0.3, 0.25, 1}, 0.7), 26);
    addStems();
  }

  VoxelType type() const override { return VoxelType::rgba8; }
  glm::ivec3 dims() const override { return dims_; }

  void writeRow(int y, int z, std::span<std::byte> out) override {
    glm::dvec3 point(0, (y + 0.5) * voxel_, (z + 0.5) * voxel_);
    row_ammonites_.clear();
    for (Ammonite& ammonite : ammonites_) {
      const glm::dvec3 off = glm::abs(point - ammonite.center());
      if (off.y <= ammonite.extent().y && off.z <= ammonite.extent().z) row_ammonites_.push_back(&ammonite);
    }
    row_stems_.clear();
    for (const Stem& stem : stems_) {
      const glm::dvec3 end = stem.from + stem.along * stem.length;
      const bool near = point.y > std::min(stem.from.y, end.y) - stem.radius &&
                        point.y < std::max(stem.from.y, end.y) + stem.radius &&
                        point.z > std::min(stem.from.z, end.z) - stem.radius &&
                        point.z < std::max(stem.from.z, end.z) + stem.radius;
      if (near) row_stems_.push_back(&stem);
    }
    for (int x = 0; x < dims_.x; ++x) {
      point.x = (x + 0.5) * voxel_;
      if (const auto matter = at(point, {x, y, z})) writeMatter(*matter, &out[static_cast<std::size_t>(x) * 4]);
    }
  }

 private:
  void addAmmonite(glm::dvec3 center, double radius, const glm::dmat3& frame, int ribs) {
    ammonites_.emplace_back(Ammonite::Shape{.center = center,
                                            .radius = radius,
                                            .frame = frame,
                                            .ribs = ribs,
                                            .voxel = voxel_,
                                            .seed = static_cast<std::uint32_t>(1000 * ammonites_.size())});
  }

  void addStems() {
    HashSequence places(77);
    for (int i = 0; i < 16; ++i) {
      Stem stem;
      stem.from = {places.between(0.08, 0.92), places.between(0.06, 0.6), places.between(0.05, 0.14)};
      const glm::dvec3 normal{places.between(-0.3, 0.3), places.between(-0.3, 0.3), 1.0};
      stem.along = frameAround(normal, places.unit())[0];
      stem.length = places.between(0.03, 0.14);
      stem.radius = places.between(0.006, 0.013);
      stem.disc = stem.radius * places.between(0.5, 0.8);
      stems_.push_back(stem);
    }
  }

  std::optional<Matter> at(glm::dvec3 point, glm::ivec3 index) {
    for (Ammonite* ammonite : row_ammonites_) {
      if (std::fabs(point.x - ammonite->center().x) > ammonite->extent().x) continue;
      if (auto matter = ammonite->at(point)) return matter;
    }
    const double depth = depthInMatrix(point);
    if (depth <= 0) return std::nullopt;
    for (const Stem* stem : row_stems_) {
      if (auto matter = stem->at(point)) return matter;
    }
    return matrixAt(point, index, depth);
  }

  // How deep a point lies under the block's rough surface, roughly; negative in the air.
  double depthInMatrix(glm::dvec3 point) {
    const double round = 0.07;
    const glm::dvec3 half = shape_ * 0.5 - 0.03;
    const glm::dvec3 corner = glm::abs(point - shape_ * 0.5) - (half - round);
    const double outside = glm::length(glm::max(corner, 0.0));
    double depth = round - outside - std::min(std::max({corner.x, corner.y, corner.z}), 0.0);
    // The window that a preparator has opened over the ammonite's outer whorl.
    const glm::dvec3 window = (point - glm::dvec3(0.62, 0.46, 0.52)) / glm::dvec3(0.31, 0.27, 0.30);
    depth = std::min(depth, (glm::length(window) - 1) * 0.2);
    constexpr double kRelief = 0.045;
    if (depth > kRelief || depth < -kRelief) return depth;
    return depth + kRelief * (2 * surface_.at(point * 11.0) - 1);
  }

  Matter matrixAt(glm::dvec3 point, glm::ivec3 index, double depth) {
    const double warp = warp_.at(point * 3.1);
    const double bed = (point.y + 0.18 * point.x - 0.1 * point.z + 0.075 * warp) * 26;
    const double whole = std::floor(bed);
    const auto layer = static_cast<std::int32_t>(whole);
    const double share = smoothStep(0.72, 1.0, bed - whole);
    const double tone = mixed(hashUnit(hashCell(layer, 1, 0, 5)), hashUnit(hashCell(layer + 1, 1, 0, 5)), share);
    const double rust = mixed(hashUnit(hashCell(layer, 2, 0, 5)), hashUnit(hashCell(layer + 1, 2, 0, 5)), share);
    const double mottle = mottle_.at(point * 38.0);
    const double grain = hashUnit(hashCell(index.x, index.y, index.z, 9));
    const double lamina = 0.5 + 0.5 * wave(bed * 5);
    glm::dvec3 color = glm::mix(glm::dvec3(112, 98, 82), glm::dvec3(206, 186, 150), 0.15 + 0.75 * tone);
    color = glm::mix(color, glm::dvec3(164, 98, 62), 0.55 * smoothStep(0.7, 0.95, rust));
    color *= 0.78 + 0.16 * mottle + 0.08 * grain + 0.06 * lamina;
    const double weathered = smoothStep(0.02, 0.0, depth);
    const double density = 26 + 46 * tone + 14 * mottle + 10 * grain + 6 * lamina + 6 * weathered;
    return {color, std::min(density, 110.0)};
  }

  glm::ivec3 dims_;
  double voxel_;
  glm::dvec3 shape_{1};
  std::vector<Ammonite> ammonites_;
  std::vector<Stem> stems_;
  std::vector<Ammonite*> row_ammonites_;
  std::vector<const Stem*> row_stems_;
  FractalNoise surface_{31, 4};
  Noise warp_{41};
  Noise mottle_{51};
};

}  // namespace

std::unique_ptr<DemoModel> makeFossil(int size) { return std::make_unique<Fossil>(size); }

}  // namespace blockwalk
