// SPDX-License-Identifier: Apache-2.0
// `cosmos`: galaxies in clusters and filaments around voids; nearly all of it is empty (u16 or f32).
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

#include "volume/demo/model.h"
#include "volume/demo/noise.h"
#include "volume/demo/web.h"

namespace blockwalk {
namespace {

// What all threads look at.
struct Galaxies {
  explicit Galaxies(int size) : pieces(growWeb(size)), index(pieces) {}
  std::vector<WebPiece> pieces;
  WebIndex index;
};

class Cosmos final : public SparseModel {
 public:
  Cosmos(int size, VoxelType type)
      : type_(type), dims_(demoDims(size, {1, 1, 1})), voxel_(1.0 / size), all_(std::make_shared<Galaxies>(size)) {
    grain_scale_ = 0.6 / std::max(all_->pieces.front().capsule.radius_a * 0.25, voxel_);
  }

  VoxelType type() const override { return type_; }
  glm::ivec3 dims() const override { return dims_; }
  std::unique_ptr<DemoModel> another() const override { return std::make_unique<Cosmos>(*this); }

  void findRuns(const VoxelBox& box, std::vector<VoxelRun>& runs) override {
    runs.clear();
    const int step = std::max({box.dims().y, box.dims().z, 8});
    VoxelBox part = box;
    for (; part.begin.x < box.end.x; part.begin.x = part.end.x) {
      part.end.x = std::min(part.begin.x + step, box.end.x);
      if (!all_->index.mayReach(placeOf(part.begin), placeOf(part.end))) continue;
      const bool goes_on = !runs.empty() && runs.back().end == part.begin.x;
      if (!goes_on) runs.push_back({.begin = part.begin.x, .end = 0});
      runs.back().end = part.end.x;
    }
  }

  void writeBox(const VoxelBox& box, std::span<std::byte> out) override {
    const glm::ivec3 extent = box.dims();
    densities_.assign(out.size() / voxelBytes(type_), 0);
    all_->index.findIn(placeOf(box.begin), placeOf(box.end), near_);
    for (const std::uint32_t i : near_) addPiece(all_->pieces[i], box);
    std::size_t at = 0;
    for (int z = 0; z < extent.z; ++z) {
      for (int y = 0; y < extent.y; ++y) {
        for (int x = 0; x < extent.x; ++x, ++at) {
          if (densities_[at] > 0) write(box.begin + glm::ivec3(x, y, z), densities_[at], &out[at * voxelBytes(type_)]);
        }
      }
    }
  }

 private:
  glm::dvec3 placeOf(glm::ivec3 corner) const { return glm::dvec3(corner) * voxel_; }

  // Where several pieces lie, the densest counts: so strands go on from piece to piece.
  void addPiece(const WebPiece& piece, const VoxelBox& box) {
    const Capsule& capsule = piece.capsule;
    const double reach = std::max(capsule.radius_a, capsule.radius_b);
    const glm::ivec3 low =
        glm::max(glm::ivec3(glm::floor((glm::min(capsule.a, capsule.b) - reach) / voxel_)), box.begin);
    const glm::ivec3 high =
        glm::min(glm::ivec3(glm::floor((glm::max(capsule.a, capsule.b) + reach) / voxel_)) + 1, box.end);
    const glm::ivec3 extent = box.dims();
    for (int z = low.z; z < high.z; ++z) {
      for (int y = low.y; y < high.y; ++y) {
        const glm::ivec3 off = glm::ivec3(low.x, y, z) - box.begin;
        double* density = &densities_[static_cast<std::size_t>((off.z * extent.y + off.y) * extent.x + off.x)];
        glm::dvec3 point = (glm::dvec3(low.x, y, z) + 0.5) * voxel_;
        for (int x = low.x; x < high.x; ++x, ++density) {
          point.x = (x + 0.5) * voxel_;
          *density = std::max(*density, piece.densityAt(point));
        }
      }
    }
  }

  void write(glm::ivec3 voxel, double density, std::byte* out) {
    const double grain = grain_.at((glm::dvec3(voxel) + 0.5) * voxel_ * grain_scale_);
    const double value = std::floor(std::min(1.0, density * (0.55 + 0.9 * grain)) * 65535);
    if (type_ == VoxelType::u16) {
      const auto stored = static_cast<std::uint16_t>(value);
      std::memcpy(out, &stored, sizeof stored);
    } else {
      const auto stored = static_cast<float>(value * (1.0 / 65536));
      std::memcpy(out, &stored, sizeof stored);
    }
  }

  VoxelType type_;
  glm::ivec3 dims_;
  double voxel_;
  std::shared_ptr<const Galaxies> all_;
  double grain_scale_ = 1;
  FractalNoise grain_{71, 3};
  std::vector<double> densities_;  // of a box
  std::vector<std::uint32_t> near_;
};

}  // namespace

std::unique_ptr<DemoModel> makeCosmos(int size) { return std::make_unique<Cosmos>(size, VoxelType::u16); }
std::unique_ptr<DemoModel> makeCosmosOfFloats(int size) { return std::make_unique<Cosmos>(size, VoxelType::f32); }

}  // namespace blockwalk
