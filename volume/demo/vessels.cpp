// SPDX-License-Identifier: Apache-2.0
// `vessels`: a tree of blood vessels as contrast medium shows it, thinner and fainter with every fork (u8).
#include <algorithm>
#include <cmath>
#include <vector>

#include "volume/demo/capsules.h"
#include "volume/demo/model.h"
#include "volume/demo/noise.h"

namespace blockwalk {
namespace {

constexpr double kSide = 1.0;
constexpr double kThinnest = 0.0016;

class Tree {
 public:
  std::vector<Capsule> grow() {
    branch({0.5, 0.0, 0.5}, {0, 1, 0}, 0.026, 0);
    branch({0.36, 0.0, 0.44}, {-0.25, 1, 0.1}, 0.015, 0);
    branch({0.63, 0.0, 0.58}, {0.25, 1, -0.1}, 0.015, 0);
    return std::move(capsules_);
  }

 private:
  // A vessel wanders in short pieces and then forks; the cubes of the radii add up (Murray 1926).
  void branch(glm::dvec3 at, glm::dvec3 direction, double radius, int depth) {
    if (radius < kThinnest || depth > 14) return;
    direction = glm::normalize(direction);
    const int pieces = 3 + static_cast<int>(places_.bits() % 3);
    for (int i = 0; i < pieces; ++i) {
      const glm::dvec3 wander{places_.between(-1, 1), places_.between(-1, 1), places_.between(-1, 1)};
      // Drawn away from the middle, so that the tree fills its room.
      const glm::dvec3 outward = at - glm::dvec3(0.5, 0.35, 0.5);
      direction = glm::normalize(direction + 0.28 * wander + 0.25 * outward);
      const double length = 3.1 * radius + 0.007;
      glm::dvec3 next = at + direction * length;
      for (int axis = 0; axis < 3; ++axis) {
        if (next[axis] < 0.03 || next[axis] > kSide - 0.03) direction[axis] = -direction[axis];
      }
      next = at + direction * length;
      const double thinner = radius * 0.975;
      capsules_.push_back({at, next, radius, thinner});
      at = next;
      radius = thinner;
    }
    const double share = places_.between(0.5, 0.86);
    const glm::dvec3 any{places_.between(-1, 1), places_.between(-1, 1), places_.between(-1, 1)};
    const glm::dvec3 side = glm::normalize(glm::cross(direction, any));
    const double larger = radius * powTwo(logTwo(share) / 3);
    const double smaller = radius * powTwo(logTwo(1 - share) / 3);
    branch(at, direction + side * (1.15 * (1 - share)), larger, depth + 1);
    branch(at, direction - side * (1.3 * share), smaller, depth + 1);
  }

  HashSequence places_{2024};
  std::vector<Capsule> capsules_;
};

class Vessels final : public DemoModel {
 public:
  explicit Vessels(int size)
      : dims_(demoDims(size, {1, 1, 1})),
        voxel_(1.0 / size),
        capsules_(Tree().grow()),
        index_(capsules_, kSide, kSide) {
    // Thinner than a voxel they would fall apart into dots.
    for (Capsule& capsule : capsules_) {
      capsule.radius_a = std::max(capsule.radius_a, 0.75 * voxel_);
      capsule.radius_b = std::max(capsule.radius_b, 0.75 * voxel_);
    }
    index_ = CapsuleIndex(capsules_, kSide, kSide);
  }

  VoxelType type() const override { return VoxelType::u8; }
  glm::ivec3 dims() const override { return dims_; }

  void writeRow(int y, int z, std::span<std::byte> out) override {
    glm::dvec3 point(0, (y + 0.5) * voxel_, (z + 0.5) * voxel_);
    for (const std::uint32_t i : index_.near(point.y, point.z)) {
      const Capsule& capsule = capsules_[i];
      const double reach = std::max(capsule.radius_a, capsule.radius_b);
      const int first = static_cast<int>(std::floor((std::min(capsule.a.x, capsule.b.x) - reach) / voxel_));
      const int last = static_cast<int>(std::floor((std::max(capsule.a.x, capsule.b.x) + reach) / voxel_));
      for (int x = std::max(first, 0); x <= std::min(last, dims_.x - 1); ++x) {
        point.x = (x + 0.5) * voxel_;
        const CapsuleHit hit = locateInCapsule(capsule, point);
        if (hit.distance >= 1) continue;
        const double radius = mixed(capsule.radius_a, capsule.radius_b, hit.along);
        const double bright = 96 + 150 * std::min(1.0, std::sqrt(radius / 0.02));
        const double grain = hashUnit(hashCell(x, y, z, 15));
        const double value = bright * (1 - 0.35 * hit.distance * hit.distance) + 8 * grain;
        std::byte& voxel = out[static_cast<std::size_t>(x)];
        voxel = std::max(voxel, static_cast<std::byte>(std::min(255, static_cast<int>(value))));
      }
    }
  }

 private:
  glm::ivec3 dims_;
  double voxel_;
  std::vector<Capsule> capsules_;
  CapsuleIndex index_;
};

}  // namespace

std::unique_ptr<DemoModel> makeVessels(int size) { return std::make_unique<Vessels>(size); }

}  // namespace blockwalk
