// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numeric>

#include "volume/slice/slice.h"

namespace blockwalk {
namespace {

constexpr std::string_view kAxes = "xyz";

std::vector<int> chosenChannels(const VolumeInfo& info, const std::vector<int>& channels) {
  const auto count = static_cast<int>(info.channels.size());
  std::vector<int> all(info.channels.size());
  std::iota(all.begin(), all.end(), 0);
  for (const int channel : channels) {
    if (channel < 0 || channel >= count) {
      throw SliceError("channels", fmt::format("{} is not within 0..{}", channel, count - 1));
    }
  }
  return channels.empty() ? all : channels;
}

int chosenLevel(const VolumeInfo& info, int level) {
  const auto levels = static_cast<int>(info.levels.size());
  if (level < 0 || level >= levels) {
    throw SliceError("level", fmt::format("{} is not within 0..{}", level, levels - 1));
  }
  return level;
}

// Between labels there is nothing, and what is between is the name of something else.
void refuseLabels(const VolumeInfo& info, const SlicePlan& plan, const char* field, std::string_view choice) {
  for (const int number : plan.channels) {
    if (info.channels[static_cast<std::size_t>(number)].values != ChannelValues::labels) continue;
    throw SliceError(field, fmt::format("{}: channel {} holds labels, which have none", choice, number));
  }
}

// Voxels of the level that the voxels of level 0 lie in.
VoxelBox levelBox(const VoxelBox& box, int level) {
  const int side = 1 << level;
  return {.begin = box.begin / side, .end = (box.end + (side - 1)) / side};
}

void checkExtent(const SlicePlan& plan, std::uint64_t deep, const char* field) {
  if (plan.width > kMaxSliceSide || plan.height > kMaxSliceSide) {
    throw SliceError("level", fmt::format("{}: the picture has {} x {} pixels, at most {} a side may be", plan.level,
                                          plan.width, plan.height, kMaxSliceSide));
  }
  const std::uint64_t pixels = plan.pixels() * plan.channels.size();
  if (4 * pixels > kMaxSliceBytes) {
    throw SliceError(
        field, fmt::format("the slice has {} pixels of all channels, at most {} may be", pixels, kMaxSliceBytes / 4));
  }
  if (deep > kMaxSliceSamples / pixels) {
    throw SliceError("thickness", fmt::format("{} voxels through {} pixels are more than {}: choose a thinner slab, a "
                                              "coarser level or fewer pixels",
                                              deep, pixels, kMaxSliceSamples));
  }
}

// Blocks that a box hits, edges in blocks, wherever it begins: the mean over all places in the lattice, which is the
// volume of the box widened by a block (Steiner's formula for a cube).
double blocksHit(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  const glm::dvec3 faces = glm::abs(glm::cross(a, b)) + glm::abs(glm::cross(b, c)) + glm::abs(glm::cross(c, a));
  const glm::dvec3 widths = glm::abs(a) + glm::abs(b) + glm::abs(c);
  return std::abs(glm::dot(glm::cross(a, b), c)) + faces.x + faces.y + faces.z + widths.x + widths.y + widths.z + 1;
}

// How many blocks of one channel are read for a plane's picture, as its reader goes: square by square, each once for
// all layers of samples.
double readsOf(const VolumeInfo& info, const SlicePlan& plan) {
  const glm::ivec3 dims = info.level(plan.level, plan.form).dims;
  const glm::dvec3 blocks = glm::dvec3(dims) / static_cast<double>(info.blockVoxels());
  const glm::dmat4 index_from_world = glm::inverse(info.world_from_index);
  const double scale = std::ldexp(1.0 / info.blockVoxels(), -plan.level);
  const auto inBlocks = [&](const glm::dvec3& world, double w) {
    return scale * glm::dvec3(index_from_world * glm::dvec4(world, w));
  };
  const glm::dvec3 corner = inBlocks(plan.corner, 1);
  const glm::dvec3 right = inBlocks(plan.right, 0);
  const glm::dvec3 down = inBlocks(plan.down, 0);
  const glm::dvec3 through = inBlocks(plan.through, 0);
  const glm::dvec3 whole = glm::ceil(blocks);
  double reads = 0;
  for (int top = 0; top < plan.height; top += kSliceSquare) {
    for (int left = 0; left < plan.width; left += kSliceSquare) {
      const int width = std::min(kSliceSquare, plan.width - left);
      const int height = std::min(kSliceSquare, plan.height - top);
      const glm::dvec3 first = corner + static_cast<double>(left) * right + static_cast<double>(top) * down;
      const glm::dvec3 across = static_cast<double>(width) * right;
      const glm::dvec3 along = static_cast<double>(height) * down;
      const glm::dvec3 lo = first + glm::min(across, 0.0) + glm::min(along, 0.0) + glm::min(through, 0.0);
      const glm::dvec3 hi = first + glm::max(across, 0.0) + glm::max(along, 0.0) + glm::max(through, 0.0);
      if (glm::any(glm::lessThan(hi, glm::dvec3(0))) || glm::any(glm::greaterThan(lo, blocks))) continue;
      const double samples = static_cast<double>(plan.samples) * width * height * (plan.is_linear ? 8 : 1);
      reads += std::min({blocksHit(across, along, through), samples, whole.x * whole.y * whole.z});
    }
  }
  return reads;
}

void checkReads(const VolumeInfo& info, const SlicePlan& plan) {
  const double reads = readsOf(info, plan) * static_cast<double>(plan.channels.size());
  if (reads <= static_cast<double>(kMaxSliceBlocks)) return;
  throw SliceError("level",
                   fmt::format("{}: some {:.0f} blocks of the volume would be read, at most {} may be: choose a "
                               "coarser level, smaller or fewer pixels, or a thinner slab",
                               plan.level, reads, kMaxSliceBlocks));
}

void planAxis(const VolumeInfo& info, const SliceCut& cut, const AxisCut& along, SlicePlan& plan) {
  const int axis = along.axis;
  const int length = info.dims[axis];
  if (along.index < 0 || along.index >= length) {
    throw SliceError("index", fmt::format("{} is not within 0..{}, the voxels along {}", along.index, length - 1,
                                          kAxes[static_cast<std::size_t>(axis)]));
  }
  VoxelBox box = along.box.value_or(VoxelBox{.begin = glm::ivec3(0), .end = info.dims});
  for (int i = 0; i < 3; ++i) {
    if (box.begin[i] >= 0 && box.begin[i] < box.end[i] && box.end[i] <= info.dims[i]) continue;
    throw SliceError("box", fmt::format("{}..{} along {} is not within 0..{}", box.begin[i], box.end[i],
                                        kAxes[static_cast<std::size_t>(i)], info.dims[i]));
  }
  const int begin = along.index - (along.thickness - 1) / 2;
  plan.axis = axis;
  plan.first = std::max(0, begin);
  plan.last = static_cast<int>(std::min<std::int64_t>(length, std::int64_t{begin} + along.thickness));
  box.begin[axis] = plan.first;
  box.end[axis] = plan.last;
  const auto sideAt = [&](int level) {
    const glm::ivec3 dims = levelBox(box, level).dims();
    return std::max(dims[plan.columnAxis()], dims[plan.rowAxis()]);
  };
  if (cut.level != kAutoSliceLevel) {
    plan.level = chosenLevel(info, cut.level);
  } else {
    const auto coarsest = static_cast<int>(info.levels.size()) - 1;
    while (plan.level < coarsest && sideAt(plan.level) > kAutoSliceSide) ++plan.level;
  }
  if (along.thickness > 1 && cut.reduce == SliceReduce::max && info.has(plan.level, Form::maxima)) {
    plan.form = Form::maxima;
  }
  if (along.thickness > 1 && cut.reduce == SliceReduce::mean) refuseLabels(info, plan, "reduce", "mean");
  plan.box = levelBox(box, plan.level);
  const glm::ivec3 dims = plan.box.dims();
  plan.width = dims[plan.columnAxis()];
  plan.height = dims[plan.rowAxis()];
  const double side = std::ldexp(1.0, plan.level);
  plan.corner = glm::dvec3(info.world_from_index * glm::dvec4(side * glm::dvec3(plan.box.begin), 1));
  plan.right = side * glm::dvec3(info.world_from_index[plan.columnAxis()]);
  plan.down = side * glm::dvec3(info.world_from_index[plan.rowAxis()]);
  plan.through = side * dims[axis] * glm::dvec3(info.world_from_index[axis]);
  checkExtent(plan, static_cast<std::uint64_t>(dims[axis]), "box");
}

glm::dvec3 unitVector(const char* field, const glm::dvec3& direction) {
  const double length = glm::length(direction);
  if (!(length > 0) || !std::isfinite(length)) throw SliceError(field, "has no direction");
  return direction / length;
}

void checkReach(const VolumeInfo& info, const PlaneCut& cut) {
  const WorldBox world = worldBox(info);
  const double diagonal = glm::length(world.max - world.min);
  // Beyond these the digits of doubles no longer tell voxels apart.
  constexpr double kFarthest = 1e9;
  const double away = glm::length(cut.centre - 0.5 * (world.min + world.max));
  if (!(away <= kFarthest * diagonal)) {
    throw SliceError("centre", fmt::format("lies {} from the volume's, at most {} may be", away, kFarthest * diagonal));
  }
  if (!(cut.pixel > 0 && cut.pixel <= kFarthest * diagonal && cut.pixel >= diagonal / kFarthest)) {
    throw SliceError("pixel", fmt::format("{} is not within {}..{}, shares of the volume's diagonal", cut.pixel,
                                          diagonal / kFarthest, kFarthest * diagonal));
  }
  if (!(cut.thickness >= 0 && cut.thickness <= diagonal)) {
    throw SliceError("thickness",
                     fmt::format("{} is not within 0..{}, the volume's diagonal", cut.thickness, diagonal));
  }
}

void planPlane(const VolumeInfo& info, const SliceCut& cut, const PlaneCut& plane, SlicePlan& plan) {
  checkReach(info, plane);
  const glm::dvec3 right = unitVector("right", plane.right);
  const glm::dvec3 wanted = unitVector("down", plane.down);
  const glm::dvec3 across = wanted - glm::dot(wanted, right) * right;
  if (glm::length(across) < 1e-9) throw SliceError("down", "is parallel to right");
  const glm::dvec3 down = glm::normalize(across);
  const double unit = unitDistance(info);
  if (cut.level != kAutoSliceLevel) {
    plan.level = chosenLevel(info, cut.level);
  } else {
    const auto coarsest = static_cast<int>(info.levels.size()) - 1;
    while (plan.level < coarsest && std::ldexp(unit, plan.level + 1) <= plane.pixel) ++plan.level;
  }
  plan.is_linear = plane.is_linear;
  if (plane.is_linear) refuseLabels(info, plan, "filter", "linear");
  // A slab of whole voxels that an origin far away made a little thicker is still of so many.
  const double deep = plane.thickness / std::ldexp(unit, plan.level);
  if (!(deep < 1e9)) throw SliceError("thickness", fmt::format("{} is {} voxels", plane.thickness, deep));
  plan.samples = std::max(1, static_cast<int>(std::ceil(deep - 1e-6)));
  if (plan.samples > 1 && cut.reduce == SliceReduce::max && info.has(plan.level, Form::maxima)) {
    plan.form = Form::maxima;
  }
  if (plan.samples > 1 && cut.reduce == SliceReduce::mean) refuseLabels(info, plan, "reduce", "mean");
  plan.width = plane.width;
  plan.height = plane.height;
  plan.right = plane.pixel * right;
  plan.down = plane.pixel * down;
  plan.through = plane.thickness * glm::cross(right, down);
  plan.corner = plane.centre - 0.5 * plane.width * plan.right - 0.5 * plane.height * plan.down - 0.5 * plan.through;
  checkExtent(plan, static_cast<std::uint64_t>(plan.samples), "size");
  checkReads(info, plan);
}

}  // namespace

SlicePlan planSlice(const VolumeInfo& info, const SliceCut& cut) {
  SlicePlan plan;
  plan.reduce = cut.reduce;
  plan.channels = chosenChannels(info, cut.channels);
  if (const auto* along = std::get_if<AxisCut>(&cut.plane)) {
    planAxis(info, cut, *along, plan);
  } else {
    planPlane(info, cut, std::get<PlaneCut>(cut.plane), plan);
  }
  return plan;
}

}  // namespace blockwalk
