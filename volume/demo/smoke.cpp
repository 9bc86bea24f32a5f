// SPDX-License-Identifier: Apache-2.0
// `smoke`: a plume that rises, swirls and breaks up; f32 in 0..1, exactly 0 outside.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "volume/demo/model.h"
#include "volume/demo/noise.h"

namespace blockwalk {
namespace {

constexpr double kWidth = 0.62;  // of the box, over its height

class Smoke final : public DemoModel {
 public:
  explicit Smoke(int size) : dims_(demoDims(size, {62, 100, 62})), voxel_(1.0 / size) {}

  VoxelType type() const override { return VoxelType::f32; }
  glm::ivec3 dims() const override { return dims_; }

  void writeRow(int y, int z, std::span<std::byte> out) override {
    const double height = (y + 0.5) * voxel_;
    // The plume's middle sways more and more; it widens, and billows where it slows down.
    const double sway = 0.07 * height;
    const glm::dvec2 middle(kWidth / 2 + sway * wave(height * 1.3), kWidth / 2 + sway * wave(height * 1.1 + 0.3));
    const double radius = 0.035 + 0.17 * smoothStep(0.0, 0.8, height) + 0.02 * wave(height * 3.2);
    const double off_z = (z + 0.5) * voxel_ - middle.y;
    const double reach2 = 1.7 * 1.7 * radius * radius - off_z * off_z;
    if (reach2 <= 0) return;
    const double reach = std::sqrt(reach2);
    const int first = std::max(0, static_cast<int>((middle.x - reach) / voxel_));
    const int last = std::min(dims_.x - 1, static_cast<int>((middle.x + reach) / voxel_));
    for (int x = first; x <= last; ++x) {
      const double off_x = (x + 0.5) * voxel_ - middle.x;
      const double value = at({(x + 0.5) * voxel_, height, (z + 0.5) * voxel_}, {off_x, off_z}, radius);
      // Steps of 1/4096: far coarser than any difference in rounding.
      const auto stored = static_cast<float>(std::floor(value * 4096) / 4096);
      std::memcpy(&out[static_cast<std::size_t>(x) * 4], &stored, 4);
    }
  }

 private:
  double at(glm::dvec3 point, glm::dvec2 off, double radius) {
    const double edge = std::sqrt(glm::dot(off, off)) / radius;
    // Coarse noise carries the fine noise along, which curls it.
    const glm::dvec3 rising = point * glm::dvec3(7, 5, 7);
    const double push = swirl_.at(rising);
    const double pull = counter_swirl_.at(rising + 31.0);
    const double cloud = cloud_.at(point * 15.0 + glm::dvec3(2.6 * push, -1.3 * pull, 2.6 * pull));
    // Near its mouth the stream is smooth and dense.
    const double rough = smoothStep(-0.05, 0.35, point.y);
    const double body = 1.15 - edge * 0.85 + 2.3 * rough * (cloud - 0.5);
    const double faded = 1 - smoothStep(0.62, 0.99, point.y);
    const double value = (body - 0.62 + 0.25 * (faded - 1)) * (0.35 + 0.9 * faded);
    return std::min(std::max(value, 0.0), 1.0);
  }

  glm::ivec3 dims_;
  double voxel_;
  Noise swirl_{141};
  Noise counter_swirl_{151};
  FractalNoise cloud_{161, 5};
};

}  // namespace

std::unique_ptr<DemoModel> makeSmoke(int size) { return std::make_unique<Smoke>(size); }

}  // namespace blockwalk
