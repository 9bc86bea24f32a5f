// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/plan_needs.h"

#include <algorithm>

#include "renderer/plan/density_scale.h"
#include "renderer/plan/transfer_table.h"
#include "renderer/plan/visible_densities.h"
#include "shaders/kernel_interface.h"

namespace blockwalk {
namespace {

// `level`: that is drawn by the table.
TableRecipe tableRecipe(const ResolvedView& view, const VolumeInfo& info, int level, const ChannelPlan& drawn) {
  return {.range = drawn.range,
          .transfer = view.channels[drawn.channel].transfer,
          .shape = view.transfer_shape,
          .exact = info.type != VoxelType::f32 && view.filter == Filter::nearest && looksAtOpacity(view),
          // Averages and interpolations with empty voxels lie below level 0's smallest density.
          .mixes_empties = level > 0 || view.filter == Filter::linear,
          .reaches = attenuatedReach(view, info, drawn),
          .integrals = view.classification == Classification::pre_integrated};
}

// The level whose table a level's densities are looked up in. Where one density of all levels is looked up, or the mean
// over them, they have one.
int levelOfTable(const ResolvedView& view, const Plan& plan, int level) {
  return showsExtreme(view.mode) || view.mode == Mode::mean ? std::max(level, plan.farLevel()) : level;
}

// Another part of the level.
Need& addPart(const Need& of_level, Part part, std::vector<Need>& needs) {
  Need& need = needs.emplace_back(of_level);
  need.part = part;
  return need;
}

// Of one channel of a level: voxels and what is kept of them, and its table.
void addChannelNeeds(const ResolvedView& view, const VolumeInfo& info, const Plan& plan, const ChannelPlan& drawn,
                     const Need& of_level, std::vector<Need>& needs) {
  const auto finder = static_cast<Finder>(plan.key.finder);
  const auto channel = static_cast<int>(drawn.channel);
  const auto add = [&](Part part) -> Need& {
    Need& need = addPart(of_level, part, needs);
    need.channel = channel;
    return need;
  };
  const bool blocks = view.mode == Mode::blocks;
  const bool culls = plan.key.cull != 0 && !blocks;
  add(Part::voxels);
  add(Part::blocks);
  if (culls || plan.macrocell_voxels > 0) add(Part::masks);
  if (culls) add(Part::visible_quarters).range = onDevice(drawn.range, info, drawn.channel);
  if (finder == Finder::none) add(Part::empty) = {.part = Part::empty, .apron = plan.apron, .channel = channel};
  if (isScalar(info) && !blocks) {
    needs.push_back({.part = Part::table,
                     .channel = channel,
                     .table = tableRecipe(view, info, levelOfTable(view, plan, of_level.level), drawn)});
  }
}

// The active macrocells of a level, and what they are found with.
void addRegionNeeds(const ResolvedView& view, const VolumeInfo& info, const Plan& plan, const Need& of_level,
                    std::vector<Need>& needs) {
  Need region = of_level;
  region.part = plan.key.finder == gpu::kFinderClusters ? Part::clusters : Part::boundary;
  region.macrocell_voxels = plan.macrocell_voxels;
  for (const ChannelPlan& drawn : plan.channels) {
    const auto channel = static_cast<int>(drawn.channel);
    const float scale =
        isScalar(info) && view.mode != Mode::blocks
            ? tableSpan(tableRecipe(view, info, levelOfTable(view, plan, of_level.level), drawn), info, drawn.channel)
                  .scale
            : 1;
    region.region.push_back(
        {.channel = channel, .range_mask = drawn.range_mask, .densities = visibleDensities(view, info, drawn, scale)});
    Need& macrocells = addPart(of_level, Part::macrocells, needs);
    macrocells.channel = channel;
    macrocells.macrocell_voxels = plan.macrocell_voxels;
  }
  needs.push_back(std::move(region));
}

// Of a level that rays walk through: what finders look in.
void addFinderNeeds(const ResolvedView& view, const VolumeInfo& info, const Plan& plan, const Need& of_level,
                    std::vector<Need>& needs) {
  const auto finder = static_cast<Finder>(plan.key.finder);
  const auto add = [&](Part part) -> Need& { return addPart(of_level, part, needs); };
  if (finder == Finder::grid || finder == Finder::none || plan.macrocell_voxels > 0) add(Part::grid);
  if (finder == Finder::octree) add(Part::octree).of_blocks = view.mode == Mode::blocks;
  if (finder == Finder::query) add(Part::instances);
  if (plan.macrocell_voxels > 0) addRegionNeeds(view, info, plan, of_level, needs);
}

// Of a paged level: which block of the level that stands in covers each of its own.
void addAncestors(const CoarsePlan& stand_in, const Need& of_level, std::vector<Need>& needs) {
  Need& ancestors = addPart(of_level, Part::ancestors, needs);
  ancestors.coarse_level = stand_in.level;
  ancestors.coarse_form = stand_in.form;
}

}  // namespace

double attenuatedReach(const ResolvedView& view, const VolumeInfo& info, const ChannelPlan& drawn) {
  if (view.mode != Mode::attenuated_mip || !isScalar(info)) return kInfinity;
  const ChannelInfo& channel = info.channels[drawn.channel];
  const ResolvedChannel& look = view.channels[drawn.channel];
  return std::max(channel.storedFromData(look.range.lo), channel.storedFromData(look.transfer.front().value));
}

void setNeeds(const ResolvedView& view, const VolumeInfo& info, Plan& plan) {
  std::vector<Need>& needs = plan.needs;
  const auto add = [&](const Need& of_level, bool is_walked) {
    for (const ChannelPlan& drawn : plan.channels) {
      addChannelNeeds(view, info, plan, drawn, of_level, needs);
    }
    if (is_walked) addFinderNeeds(view, info, plan, of_level, needs);
  };
  const Need own{
      .level = plan.level, .form = plan.form, .window = plan.window, .paged = plan.isPaged(), .apron = plan.apron};
  const auto ofLevel = [&](const CoarsePlan& coarse) {
    return Need{.level = coarse.level,
                .form = coarse.form,
                .window = coarse.window,
                .paged = coarse.paged,
                .apron = plan.apron};
  };
  add(own, true);
  for (CoarsePlan& coarse : plan.coarse) {
    coarse.first_need = needs.size();
    add(ofLevel(coarse), coarse.is_walked);
  }
  if (!plan.isPaged()) return;
  const CoarsePlan& stand_in = plan.coarse[*plan.stand_in];
  addAncestors(stand_in, own, needs);
  for (const CoarsePlan& coarse : plan.coarse) {
    if (coarse.paged) addAncestors(stand_in, ofLevel(coarse), needs);
  }
}

}  // namespace blockwalk
