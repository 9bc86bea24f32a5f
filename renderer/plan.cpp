// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "shaders/kernel_interface.h"

namespace blockwalk {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

float floatAtLeast(double value) {
  const auto rounded = static_cast<float>(value);
  return rounded < value ? std::nextafter(rounded, std::numeric_limits<float>::infinity()) : rounded;
}

float floatAtMost(double value) {
  const auto rounded = static_cast<float>(value);
  return rounded > value ? std::nextafter(rounded, -std::numeric_limits<float>::infinity()) : rounded;
}

// Data-unit interval outside which a transfer function is transparent.
DensityRange transferSupport(const std::vector<TransferPoint>& points) {
  const auto opaque = [](const TransferPoint& p) { return p.opacity > 0; };
  const auto first = std::ranges::find_if(points, opaque);
  if (first == points.end()) return {kInfinity, -kInfinity};
  const auto last = std::find_if(points.rbegin(), points.rend(), opaque);
  return {first == points.begin() ? -kInfinity : std::prev(first)->value,
          last == points.rbegin() ? kInfinity : std::prev(last)->value};
}

bool showsThroughTable(const View& view, const VolumeInfo& info) {
  return info.type != VoxelType::rgba8 && view.mode != Mode::blocks;
}

Finder chooseFinder(const View& view, const VolumeInfo& info, int level, const DeviceTraits& device) {
  const std::uint64_t blocks = info.levels[static_cast<std::size_t>(level)].block_count;
  const bool can_query = device.ray_query && blocks <= device.max_instances;
  if (view.finder == Finder::query && !device.ray_query) {
    throw ViewError("finder", "query: this device has no ray queries; use grid or auto");
  }
  if (view.finder == Finder::query && !can_query) {
    throw ViewError(
        "finder", fmt::format("query: the level has {} blocks, the device takes {} instances; use grid or auto", blocks,
                              device.max_instances));
  }
  if (view.finder != Finder::automatic) return view.finder;
  // A software ray query costs about a microsecond, a grid step nanoseconds; with ray-tracing hardware it is reversed.
  return can_query && !device.software ? Finder::query : Finder::grid;
}

}  // namespace

std::string describe(const KernelKey& key) {
  static constexpr std::string_view kModes[] = {"blend", "first-hit", "blocks"};
  static constexpr std::string_view kFinders[] = {"auto", "query", "grid"};
  std::string text = fmt::format("{} {} {}", voxelTypeName(static_cast<VoxelType>(key.voxel_type)), kModes[key.mode],
                                 kFinders[key.finder]);
  const auto add = [&](std::uint32_t on, std::string_view word) {
    if (on != 0) text += fmt::format(" {}", word);
  };
  add(key.walk, "walk");
  add(key.cull, "cull");
  add(key.range_open, "range-open");
  add(key.test_voxel, "test-voxel");
  add(key.clip, "clip");
  add(key.opaque_background == 0 ? 1 : 0, "transparent");
  add(key.count, "count");
  add(key.probe, "probe");
  return text + fmt::format(" {}^3x{}^3", key.block_side, key.subblock_side);
}

StoredRange visibleRange(const View& view, const VolumeInfo& info) {
  DensityRange data = *view.range;
  if (showsThroughTable(view, info)) {
    const DensityRange support = transferSupport(view.transfer);
    data = {std::max(data.lo, support.lo), std::min(data.hi, support.hi)};
  }
  StoredRange range{.lo = floatAtLeast(info.storedFromData(data.lo)), .hi = floatAtMost(info.storedFromData(data.hi))};
  if (info.type != VoxelType::f32) range = {.lo = std::ceil(range.lo), .hi = std::floor(range.hi)};
  const float above_empty = info.type == VoxelType::f32
                                ? std::nextafter(info.empty_threshold, std::numeric_limits<float>::infinity())
                                : std::floor(info.empty_threshold) + 1;
  // A bound that excludes nothing of level 0 excludes nothing of the coarser levels either, whose averages with empty
  // voxels may lie below level 0's smallest density.
  range.lo = range.lo <= info.density_min ? above_empty : std::max(range.lo, above_empty);
  range.hi = range.hi >= info.density_max ? std::numeric_limits<float>::max() : range.hi;
  return range;
}

int chooseLevel(const View& view, const VolumeInfo& info) {
  const Camera camera = makeCamera(view);
  const double pixel_slope = 2 * camera.half_height / view.height;
  double pixel = pixel_slope;  // world size of a pixel
  if (!camera.orthographic) {
    double nearest = kInfinity;
    for (int corner = 0; corner < 8; ++corner) {
      const glm::dvec4 index(glm::dvec3(info.dims) * glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2), 1);
      nearest = std::min(nearest, glm::dot(glm::dvec3(info.world_from_index * index) - camera.eye, camera.forward));
    }
    pixel = pixel_slope * nearest;
  }
  const double voxels = pixel / unitDistance(info);
  if (!(voxels >= 2)) return 0;
  const auto last = static_cast<int>(info.levels.size()) - 1;
  return static_cast<int>(std::min(std::floor(std::log2(voxels)), static_cast<double>(last)));
}

Plan plan(const View& view, const VolumeInfo& info, const DeviceTraits& device, bool count, bool probe) {
  Plan plan;
  plan.level = view.level == kAutoLevel ? chooseLevel(view, info) : view.level;
  plan.range = visibleRange(view, info);
  const LevelInfo& level = info.levels[static_cast<std::size_t>(plan.level)];
  plan.is_blank = plan.range.lo > plan.range.hi || level.block_count == 0;
  if (!plan.is_blank) {
    const int low = rangeMaskBin(info.bin_cuts, plan.range.lo);
    const int high = rangeMaskBin(info.bin_cuts, plan.range.hi);
    for (int bin = low; bin <= high; ++bin) plan.range_mask |= static_cast<std::uint8_t>(1 << bin);
  }
  const bool open = plan.range.lo <= info.density_min && plan.range.hi >= info.density_max;
  const Finder finder = chooseFinder(view, info, plan.level, device);
  plan.needs_grid = finder == Finder::grid;
  plan.needs_instances = finder == Finder::query;
  plan.needs_table = showsThroughTable(view, info);

  KernelKey& key = plan.key;
  key.voxel_type = static_cast<std::uint32_t>(info.type);
  key.mode = static_cast<std::uint32_t>(view.mode);
  key.finder = static_cast<std::uint32_t>(finder);
  key.walk = view.walk ? 1 : 0;
  key.cull = view.cull && !open ? 1 : 0;
  key.range_open = open ? 1 : 0;
  // The table of u8 and u16 is 0 outside the range; a density of 0 has no extinction.
  const bool rgba8_test =
      info.type == VoxelType::rgba8 && (!open || info.empty_threshold != 0 || view.mode == Mode::first_hit);
  key.test_voxel = view.mode != Mode::blocks && (rgba8_test || info.type == VoxelType::f32) ? 1 : 0;
  key.clip = view.clip ? 1 : 0;
  key.opaque_background = view.background[3] == 255 ? 1 : 0;
  key.subblock_side = static_cast<std::uint32_t>(info.subblock_side);
  key.block_side = static_cast<std::uint32_t>(info.block_side);
  key.count = count ? 1 : 0;
  key.probe = probe ? 1 : 0;
  return plan;
}

}  // namespace blockwalk
