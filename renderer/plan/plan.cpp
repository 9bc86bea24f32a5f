// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "renderer/plan/clip_planes.h"
#include "renderer/plan/level_choice.h"
#include "renderer/plan/level_window.h"
#include "renderer/plan/paging.h"
#include "renderer/plan/plan_needs.h"
#include "renderer/plan/transfer_table.h"
#include "renderer/plan/visible_densities.h"
#include "shaders/kernel_interface.h"

namespace blockwalk {
namespace {

// Of stored voxels; with more non-empty ones the search for them costs what it saves. To pass an empty voxel by is as
// cheap as a step of that search, an empty sample has eight loads.
constexpr double kHollowShare = 0.7;
constexpr double kHollowShareOfNearestBlend = 0.15;

float floatAtLeast(double value) {
  const auto rounded = static_cast<float>(value);
  return rounded < value ? std::nextafter(rounded, std::numeric_limits<float>::infinity()) : rounded;
}

float floatAtMost(double value) {
  const auto rounded = static_cast<float>(value);
  return rounded > value ? std::nextafter(rounded, -std::numeric_limits<float>::infinity()) : rounded;
}

// Data-unit interval outside which a transfer function is transparent.
DensityRange transferSupport(const std::vector<TransferPoint>& points, TransferShape shape) {
  const auto opaque = [](const TransferPoint& p) { return p.opacity > 0; };
  const auto first = std::ranges::find_if(points, opaque);
  if (first == points.end()) return {kInfinity, -kInfinity};
  const auto last = std::find_if(points.rbegin(), points.rend(), opaque);
  const bool stepped = shape == TransferShape::stepped;
  return {first == points.begin() ? -kInfinity : (stepped ? first : std::prev(first))->value,
          last == points.rbegin() ? kInfinity : std::prev(last)->value};
}

void refuseWhatIsNotDefined(const ResolvedView& view, const VolumeInfo& info) {
  if (view.classification != Classification::pre_integrated) return;
  if (view.filter != Filter::linear || view.mode != Mode::blend) {
    throw ViewError("classification", "pre-integrated: needs filter=linear and mode=blend");
  }
  if (!isScalar(info)) throw ViewError("classification", "pre-integrated: needs a scalar volume, this one is rgba8");
}

// A DDA counts tiles and macrocells in a float.
constexpr std::uint64_t kMaxCells = std::uint64_t{1} << 24;

std::uint64_t cubeCount(const VolumeInfo& info, int level, int side) {
  return cellCount(latticeDims(info.levels[static_cast<std::size_t>(level)].dims, side));
}

std::uint64_t tileCount(const VolumeInfo& info, int level) {
  return cubeCount(info, level, gpu::kGridTileSide * info.blockVoxels());
}

void refuseTooManyTiles(Finder finder, const VolumeInfo& info, int level) {
  if (canUse(finder, info, level)) return;
  throw ViewError("finder",
                  fmt::format("{}: level {} has {} tiles of {}^3 blocks, at most {} may be; use octree, or a "
                              "coarser level",
                              finderName(finder), level, tileCount(info, level), gpu::kGridTileSide, kMaxCells));
}

Finder chooseFinder(const ResolvedView& view, const VolumeInfo& info, const Plan& plan, const DeviceTraits& device) {
  const std::uint64_t blocks = info.level(plan.level, plan.form).block_count;
  const bool can_query = device.ray_query && blocks <= device.max_instances;
  const bool asks_rays =
      view.finder == Finder::query || view.finder == Finder::clusters || view.finder == Finder::boundary;
  if (asks_rays && !device.ray_query) {
    throw ViewError(
        "finder", fmt::format("{}: this device has no ray queries; use grid, octree or auto", finderName(view.finder)));
  }
  if (view.finder == Finder::query && !can_query) {
    throw ViewError(
        "finder", fmt::format("query: the level has {} blocks, the device takes {} instances; use grid or auto", blocks,
                              device.max_instances));
  }
  if (view.finder != Finder::automatic) return view.finder;
  // Where so few blocks lie so far apart that their tiles are too many, the octree has no trouble.
  const Finder without_rays = canUse(Finder::grid, info, plan.level) ? Finder::grid : Finder::octree;
  if (!can_query) return without_rays;
  if (device.fastest != Finder::automatic) return device.fastest == Finder::grid ? without_rays : device.fastest;
  // A software ray query costs about a microsecond, a grid step nanoseconds; with ray-tracing hardware it is reversed.
  return device.software ? without_rays : Finder::query;
}

// A macrocell is never a part of a subblock, whose range is all that is known of it. Where blocks are counted it is a
// block: else one would count as often as the ray enters something active in it.
int chooseMacrocell(const ResolvedView& view, const VolumeInfo& info) {
  if (view.mode == Mode::blocks) return info.blockVoxels();
  if (view.macrocell == kAutoMacrocell) return std::max(8, info.subblock_side);
  if (view.macrocell >= info.subblock_side) return view.macrocell;
  throw ViewError("macrocell", fmt::format("{}: the volume's subblocks have {} voxels; use at least that",
                                           view.macrocell, info.subblock_side));
}

void refuseTooManyMacrocells(Finder finder, const VolumeInfo& info, const Plan& plan) {
  const std::uint64_t macrocells = cubeCount(info, plan.level, plan.macrocell_voxels);
  if (macrocells <= kMaxCells) return;
  throw ViewError("finder",
                  fmt::format("{}: the level has {} macrocells of {} voxels, at most {} may be; use larger ones "
                              "(macrocell), a coarser level, or another finder",
                              finderName(finder), macrocells, plan.macrocell_voxels, kMaxCells));
}

std::uint32_t kernelOutput(Output output) {
  switch (output) {
    case Output::color:
      return gpu::kOutputColor;
    case Output::depth:
    case Output::position:
      return gpu::kOutputPoint;
    case Output::cost:
      return gpu::kOutputCost;
    case Output::queries:
      return gpu::kOutputQueries;
    case Output::mesh:
      return gpu::kOutputMesh;
    case Output::value:
      return gpu::kOutputValue;
  }
  BLOCKWALK_CHECK(static_cast<int>(output), <=, static_cast<int>(Output::value));
  return gpu::kOutputColor;
}

// What is drawn of the channels: those that can be seen, and of an iso surface the first alone.
std::vector<ChannelPlan> planChannels(const ResolvedView& view, const VolumeInfo& info) {
  std::vector<ChannelPlan> channels;
  const std::size_t count = view.mode == Mode::iso ? 1 : view.drawn.size();
  for (std::size_t i = 0; i < count; ++i) {
    const auto number = static_cast<std::size_t>(view.drawn[i]);
    ChannelPlan channel{.channel = number, .range = visibleRange(view, info, number), .range_mask = 0};
    // Means of coarser levels and interpolated values are no greater than the greatest density.
    if (channel.range.lo > std::min(channel.range.hi, info.channels[number].density_max)) continue;
    const int low = rangeMaskBin(info.channels[number].bin_cuts, channel.range.lo);
    const int high = rangeMaskBin(info.channels[number].bin_cuts, channel.range.hi);
    for (int bin = low; bin <= high; ++bin) channel.range_mask |= static_cast<std::uint8_t>(1 << bin);
    channels.push_back(channel);
  }
  return channels;
}

// Whether every stored block, subblock and non-empty voxel shows something. What is stored for the sake of a channel
// that is not drawn need not.
bool isOpen(const std::vector<ChannelPlan>& channels, const VolumeInfo& info) {
  return channels.size() == info.channels.size() && std::ranges::all_of(channels, [&](const ChannelPlan& plan) {
           const ChannelInfo& channel = info.channels[plan.channel];
           return plan.range.lo <= channel.density_min && plan.range.hi >= channel.density_max;
         });
}

// Whether colour and opacity change so little from an entry of a channel's table to the next that the nearest one is
// right to a quarter of an 8-bit step in colour, and to a sixteenth in the opacity of a step.
bool isFine(const ResolvedView& view, const VolumeInfo& volume, const ChannelPlan& channel) {
  const ChannelInfo& info = volume.channels[channel.channel];
  const std::vector<TransferPoint>& points = view.channels[channel.channel].transfer;
  if (view.transfer_shape != TransferShape::linear) return false;
  const double width = std::max<double>(std::min<double>(channel.range.hi, info.density_max), channel.range.lo) -
                       std::min({static_cast<double>(channel.range.lo), static_cast<double>(info.density_min),
                                 attenuatedReach(view, volume, channel)});
  const double half_entry = 0.5 * info.value_scale * std::max(width, 1.0) / (kTableEntries - 1);
  const double steps = std::max(view.step, 1.0);
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double share = half_entry / (points[i].value - points[i - 1].value);  // infinite where a step is
    const glm::dvec3 change = glm::abs(points[i].color - points[i - 1].color);
    if (!(share * std::max({change.r, change.g, change.b}) <= 0.25 / 255)) return false;
    if (!(share * steps * std::abs(points[i].opacity - points[i - 1].opacity) <= 0.0625 / 255)) return false;
  }
  return true;
}

// Whether so many of the stored voxels are empty that it pays to look which.
bool isHollow(const VolumeInfo& info, bool nearest_blend) {
  const double stored = static_cast<double>(info.levels[0].subblock_count) * static_cast<double>(info.subblockVoxels());
  const double share = nearest_blend ? kHollowShareOfNearestBlend : kHollowShare;
  return static_cast<double>(info.channels[0].nonempty_voxels) < share * stored;
}

bool interpolates(const ResolvedView& view) { return view.filter == Filter::linear && view.mode != Mode::blocks; }

bool isLit(const ResolvedView& view) {
  return view.lit && isPicture(view.output) && (looksAtOpacity(view) || view.mode == Mode::iso);
}

// The kernel's choices that the volume makes.
void setVolumeKey(const VolumeInfo& info, Plan& plan) {
  plan.key.voxel_type = static_cast<std::uint32_t>(info.type);
  plan.key.subblock_side = static_cast<std::uint32_t>(info.subblock_side);
  plan.key.block_side = static_cast<std::uint32_t>(info.block_side);
  plan.key.channels = static_cast<std::uint32_t>(std::max<std::size_t>(plan.channels.size(), 1));
}

// Those that say what a ray looks at, and what it passes by.
void setSkippingKey(const ResolvedView& view, const VolumeInfo& info, Plan& plan) {
  KernelKey& key = plan.key;
  const bool blocks = view.mode == Mode::blocks;
  const bool linear = interpolates(view);
  const bool open = isOpen(plan.channels, info);
  // What marches through the whole box neither walks nor culls.
  const bool skips = key.finder != static_cast<std::uint32_t>(Finder::none);
  key.walk = view.walk && skips ? 1 : 0;
  // Of several channels one may be absent from a subblock that is stored for another.
  const bool hides =
      !open || (!blocks && (plan.channels.size() > 1 || isHollow(info, view.mode == Mode::blend && !linear)));
  key.cull = view.cull && skips && hides ? 1 : 0;
  key.range_open = open ? 1 : 0;
  // Nearest blend and first-hit of u8 and u16 have a table that is 0 outside the range; a density of 0 has no
  // extinction.
  const bool table_tests = isScalar(info) && info.type != VoxelType::f32 && !linear && looksAtOpacity(view);
  const bool density_tests =
      !isScalar(info) && open && info.channels[0].empty_threshold == 0 && view.mode == Mode::blend;
  key.test_voxel = !blocks && !table_tests && !density_tests ? 1 : 0;
  key.clip = plan.planes.empty() ? 0 : 1;
}

// Those that say what becomes of what it meets.
void setPictureKey(const ResolvedView& view, const VolumeInfo& info, Plan& plan) {
  KernelKey& key = plan.key;
  const bool colored = isPicture(view.output);
  key.mode = static_cast<std::uint32_t>(view.mode);
  key.opaque_background = !colored || view.background[3] == 255 ? 1 : 0;
  key.filter = static_cast<std::uint32_t>(interpolates(view) ? Filter::linear : Filter::nearest);
  key.lit = isLit(view) ? 1 : 0;
  key.secondary = hasSecondaryRays(view) ? 1 : 0;
  key.lens = hasLens(view) ? 1 : 0;
  key.classification = static_cast<std::uint32_t>(view.classification);
  key.output = kernelOutput(view.output);
  key.antialias = view.samples > 1 ? 1 : 0;
  const bool looks_up =
      isScalar(info) && view.mode != Mode::blocks && colored && view.mode != Mode::first_hit && view.mode != Mode::iso;
  const auto is_fine = [&](const ChannelPlan& drawn) { return isFine(view, info, drawn); };
  key.fine_table = looks_up && std::ranges::all_of(plan.channels, is_fine) ? 1 : 0;
}

}  // namespace

bool hasSecondaryRays(const ResolvedView& view) {
  const bool takes_away = (view.shadow && view.lights.key > 0) || (view.occlusion > 0 && view.lights.ambient > 0);
  return isLit(view) && takes_away;
}

bool hasLens(const ResolvedView& view) { return view.aperture > 0 && view.samples > 1; }

std::string_view finderName(Finder finder) {
  static constexpr std::string_view kNames[] = {"auto", "query", "grid", "clusters", "boundary", "octree", "none"};
  return kNames[static_cast<std::size_t>(finder)];
}

StoredRange visibleRange(const ResolvedView& view, const VolumeInfo& info, std::size_t number) {
  const ChannelInfo& channel = info.channels[number];
  const ResolvedChannel& look = view.channels[number];
  const bool whole_numbers = info.type != VoxelType::f32 && view.filter == Filter::nearest;
  const auto stored = [&](const DensityRange& data) {
    const StoredRange range{.lo = floatAtLeast(channel.storedFromData(data.lo)),
                            .hi = floatAtMost(channel.storedFromData(data.hi))};
    return whole_numbers ? StoredRange{.lo = std::ceil(range.lo), .hi = std::floor(range.hi)} : range;
  };
  StoredRange range = stored(view.mode == Mode::iso ? DensityRange{view.iso, kInfinity} : look.range);
  const float above_empty = whole_numbers
                                ? std::floor(channel.empty_threshold) + 1
                                : std::nextafter(channel.empty_threshold, std::numeric_limits<float>::infinity());
  // A bound that excludes nothing of level 0 excludes nothing of the coarser levels either, whose averages with empty
  // voxels may lie below level 0's smallest density.
  const bool opens_below =
      view.mode != Mode::iso && range.lo <= channel.density_min;  // an iso value is meant as it stands
  range.lo = opens_below ? above_empty : std::max(range.lo, above_empty);
  range.hi = range.hi >= channel.density_max ? std::numeric_limits<float>::max() : range.hi;
  if (!isScalar(info) || !looksAtOpacity(view)) return range;
  // Where the transfer function is transparent it stays so, also between voxels and on coarser levels.
  const StoredRange support = stored(transferSupport(look.transfer, view.transfer_shape));
  return {.lo = std::max(range.lo, support.lo), .hi = std::min(range.hi, support.hi)};
}

Plan plan(const ResolvedView& view, const VolumeInfo& info, const DeviceTraits& device, bool count, bool probe) {
  refuseWhatIsNotDefined(view, info);
  Plan plan;
  plan.level = drawnLevel(view, info, device.finest_level);
  plan.is_coarser = plan.level > drawnLevel(view, info, 0);
  plan.channels = planChannels(view, info);
  if (view.mode == Mode::mip && info.has(plan.level, Form::maxima)) plan.form = Form::maxima;
  for (const FarLevel& far : farLevels(view, info, plan.level)) {
    plan.coarse.push_back({.level = far.level,
                           .form = far.form,
                           .is_walked = true,
                           .depth = far.depth,
                           .transmittance = far.transmittance});
  }
  plan.key.mixed = plan.coarse.empty() ? 0 : 1;
  plan.is_blank = plan.channels.empty() || info.level(plan.level, plan.form).block_count == 0;
  plan.planes = cuttingPlanes(view, info);
  const Finder finder = chooseFinder(view, info, plan, device);
  refuseTooManyTiles(finder, info, plan.level);
  if (finder == Finder::clusters || finder == Finder::boundary) {
    plan.macrocell_voxels = chooseMacrocell(view, info);
    refuseTooManyMacrocells(finder, info, plan);
  }
  plan.apron = interpolates(view) || isLit(view);
  plan.key.finder = static_cast<std::uint32_t>(finder);
  plan.key.count = count ? 1 : 0;
  plan.key.probe = probe ? 1 : 0;
  setVolumeKey(info, plan);
  setSkippingKey(view, info, plan);
  setPictureKey(view, info, plan);
  if (plan.is_blank) return plan;
  choosePaging(view, info, device, plan);
  if (plan.isPaged()) chooseWindows(view, info, device, plan);
  if (windowCells(plan) >= device.most_window_cells && drawnLevel(view, info, plan.level + 1) > plan.level) {
    DeviceTraits coarser = device;
    coarser.finest_level = plan.level + 1;
    return blockwalk::plan(view, info, coarser, count, probe);
  }
  setNeeds(view, info, plan);
  return plan;
}

bool canUse(Finder finder, const VolumeInfo& info, int level) {
  return finder == Finder::query || finder == Finder::octree || tileCount(info, level) <= kMaxCells;
}

std::size_t Plan::farCount() const {
  return static_cast<std::size_t>(std::ranges::count(coarse, true, &CoarsePlan::is_walked));
}

bool Plan::asksFor(Part part) const { return std::ranges::find(needs, part, &Need::part) != needs.end(); }

}  // namespace blockwalk
