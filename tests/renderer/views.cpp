// SPDX-License-Identifier: Apache-2.0
#include "tests/renderer/views.h"

#include <cmath>
#include <numbers>
#include <random>

#include "view/resolved_view.h"

namespace blockwalk::test {
namespace {

class ViewMaker {
 public:
  ViewMaker(const VolumeInfo& info, const reference::DenseVolume& dense, std::uint32_t seed)
      : info_(info), dense_(dense), random_(seed) {
    const WorldBox box = worldBox(info);
    center_ = (box.min + box.max) / 2.0;
    radius_ = glm::length(box.max - box.min) / 2;
  }

  View make(int index) {
    View view;
    view.width = 96;
    view.height = 72;
    view.level = 0;
    view.extinction = std::pow(10.0, uniform(-1.7, 0.3));
    for (std::size_t c = 0; c < info_.channels.size(); ++c) {
      if (info_.type != VoxelType::rgba8 && index != 0) view.channels[c].transfer = transfer(info_.channels[c]);
    }
    orbit(view, uniform(1.1, 2.5));
    place(view, index);
    view.up = direction();
    return spellOut(resolveView(view, info_));
  }

 private:
  double uniform(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random_); }

  glm::dvec3 direction() {
    const double z = uniform(-1, 1), angle = uniform(0, 2 * std::numbers::pi), r = std::sqrt(1 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
  }

  glm::dvec3 pointInside() {
    const double x = uniform(0, 1), y = uniform(0, 1), z = uniform(0, 1);
    return glm::dvec3(info_.world_from_index * glm::dvec4(glm::dvec3(x, y, z) * glm::dvec3(info_.dims), 1));
  }

  // In data units; of a visible voxel.
  double densityInside() {
    for (int i = 0; i < 100000; ++i) {
      const std::size_t voxel = std::uniform_int_distribution<std::size_t>(0, dense_.density.size() - 1)(random_);
      if (!isEmptyDensity(dense_.density[voxel], dense_.empty_threshold)) return dense_.dataAt(voxel);
    }
    return info_.channels[0].dataFromStored(static_cast<double>(info_.channels[0].density_max));
  }

  DensityRange rangeInside() {
    const double a = densityInside(), b = densityInside();
    return {.lo = std::min(a, b), .hi = std::max(a, b)};
  }

  // Never opaque: there the colour jumps with any positive length, and images could not be compared.
  std::vector<TransferPoint> transfer(const ChannelInfo& channel) {
    const double lo = channel.dataFromStored(static_cast<double>(channel.density_min));
    const double hi = channel.dataFromStored(static_cast<double>(channel.density_max));
    std::vector<TransferPoint> points;
    for (int i = 0; i < 5; ++i) {
      const double r = uniform(0, 1), g = uniform(0, 1), b = uniform(0, 1);
      points.push_back({.value = lo + (hi - lo) * (i + uniform(-0.3, 0.3)) / 4,
                        .color = {r, g, b},
                        .opacity = i == 0 ? 0 : uniform(0, 0.6)});
    }
    return points;
  }

  void orbit(View& view, double distance) {
    view.target = center_ + uniform(0, 0.2) * radius_ * direction();
    view.eye = *view.target + distance * radius_ * direction();
  }

  void alongAxis(View& view, int axis, double sign) {
    view.target = pointInside();
    view.eye = *view.target - sign * 2.5 * radius_ * glm::normalize(glm::dvec3(info_.world_from_index[axis]));
  }

  void lookFromInside(View& view) {
    view.eye = pointInside();
    view.target = *view.eye + direction();
    view.fov_degrees = 70;
  }

  ClipBox clipAround(glm::dvec3 point) {
    const glm::dvec3 before(uniform(0.1, 0.6), uniform(0.1, 0.6), uniform(0.1, 0.6));
    return {.min = point - radius_ * before, .max = point + radius_ * uniform(0.1, 0.6)};
  }

  void place(View& view, int index) {
    switch (index) {
      case 0:
      case 1:
      case 2:
        break;
      case 3:
      case 4:
        lookFromInside(view);
        break;
      case 5:
        alongAxis(view, 2, 1);
        break;
      case 6:
        alongAxis(view, 0, -1);
        view.ortho_height = 1.7 * radius_;
        break;
      case 7:
        view.ortho_height = uniform(0.5, 2.5) * radius_;
        break;
      case 8:
        lookFromInside(view);
        view.ortho_height = radius_;
        break;
      case 9:
        orbit(view, 1000);
        view.fov_degrees = 2 * std::atan(1.0 / 1000) * 180 / std::numbers::pi;
        break;
      case 10:
        view.channels[0].range = rangeInside();
        break;
      case 11: {
        const double hi = info_.channels[0].dataFromStored(static_cast<double>(info_.channels[0].density_max));
        view.channels[0].range = DensityRange{.lo = hi + 1, .hi = hi + 2};
        break;
      }
      case 12: {
        const double value = densityInside();
        view.channels[0].range = DensityRange{.lo = value, .hi = value};
        break;
      }
      case 13:
        view.channels[0].range = rangeInside();
        view.clip = clipAround(pointInside());
        break;
      case 14:
        lookFromInside(view);
        view.channels[0].range = rangeInside();
        view.clip = clipAround(*view.eye);
        break;
      case 15:
        view.width = view.height = 1;
        break;
      case 16:
        view.width = 1;
        view.height = 97;
        view.channels[0].range = rangeInside();
        break;
      case 17:
        view.width = 131;
        view.height = 7;
        break;
      case 18:
        view.background = {30, 90, 200, 128};
        view.fov_degrees = 120;
        orbit(view, 0.9);
        break;
      case 19:
        view.extinction = 5;
        view.fov_degrees = 5;
        view.background = {255, 255, 255, 255};
        break;
      default:
        break;
    }
  }

  const VolumeInfo& info_;
  const reference::DenseVolume& dense_;
  std::mt19937 random_;
  glm::dvec3 center_{0};
  double radius_ = 0;
};

}  // namespace

std::vector<View> randomViews(const VolumeInfo& info, const reference::DenseVolume& dense, std::uint32_t seed) {
  ViewMaker maker(info, dense, seed);
  std::vector<View> views;
  views.reserve(kViewCount);
  for (int i = 0; i < kViewCount; ++i) views.push_back(maker.make(i));
  return views;
}

}  // namespace blockwalk::test
