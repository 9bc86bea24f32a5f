// SPDX-License-Identifier: Apache-2.0
#include "renderer/bind.h"

#include <algorithm>

#include "renderer/plan/frame_params.h"
#include "renderer/resident/pages.h"
#include "renderer/resident/parts.h"

namespace blockwalk {
namespace {

gpu::DrawnChannel& channelOf(const Need& need, const Plan& plan, gpu::FrameLevel& level) {
  const auto found = std::ranges::find(plan.channels, static_cast<std::size_t>(need.channel), &ChannelPlan::channel);
  return level.channels[static_cast<std::size_t>(found - plan.channels.begin())];
}

void bindTable(const ResidentTable& table, gpu::DrawnChannel& params) {
  params.table = table.entries.address();
  params.integrals = table.integrals.address();
  params.table_scale = table.scale;
  params.table_first = table.first;
  params.table_last = table.last;
}

void bindRegion(const ResidentRegion& region, const Need& need, gpu::FrameLevel& level) {
  level.finder.macrocell_states = region.states.address();
  level.finder.boxes = region.boxes.address();
  level.finder.macrocell_dims = region.macrocell_dims;
  level.finder.macrocell_voxels = static_cast<float>(need.macrocell_voxels);
}

void bindPart(const Need& need, const Plan& plan, const Pins& pins, gpu::FrameLevel& level, BoundFrame& bound) {
  switch (need.part) {
    case Part::blocks:
      channelOf(need, plan, level).blocks = pins.get<ResidentBlocks>(need).records.address();
      return;
    case Part::visible_quarters:
      channelOf(need, plan, level).quarters = pins.get<ResidentQuarters>(need).quarters.address();
      return;
    case Part::empty:
      channelOf(need, plan, level).empty = pins.get<ResidentEmpty>(need).voxels.address();
      return;
    case Part::table:
      return bindTable(pins.get<ResidentTable>(need), channelOf(need, plan, level));
    case Part::grid: {
      const auto& grid = pins.get<ResidentGrid>(need);
      level.finder.grid_tiles = grid.tiles.address();
      level.finder.grid_blocks = grid.blocks.address();
      level.finder.tile_dims = grid.tile_dims;
      return;
    }
    case Part::octree:
      level.finder.octree = pins.get<ResidentOctree>(need).nodes.address();
      level.finder.octree_depth = pins.get<ResidentOctree>(need).depth;
      return;
    case Part::instances:
      bound.instances.push_back(*pins.get<ResidentInstances>(need).top.handle);
      return;
    case Part::clusters:
    case Part::boundary: {
      const auto& region = pins.get<ResidentRegion>(need);
      bindRegion(region, need, level);
      if (bound.instances.empty()) bound.build = region.build;
      bound.instances.push_back(*region.top.handle);
      return;
    }
    case Part::voxels: {  // by the records of blocks
      PagedVoxels* const pages = need.paged ? pins.get<ResidentVoxels>(need).pages.get() : nullptr;
      if (pages == nullptr) return;
      if (level.pages == gpu::kNone) {  // all channels have the same blocks
        level.pages = bound.wanted_words;
        bound.wanted_words += std::max(wordsOfBits(pages->blockCount()), 1u);  // of a window without blocks too
      }
      bound.paged.push_back({.voxels = pages, .first_word = level.pages});
      return;
    }
    case Part::ancestors:
      level.ancestors = pins.get<ResidentAncestors>(need).blocks.address();
      return;
    case Part::masks:  // what is made of them
    case Part::macrocells:
    case Part::sums:
      return;
  }
}

gpu::FrameLevel& levelOf(const Need& ancestors, const Plan& plan, gpu::FrameData& data) {
  for (std::size_t i = 0; i < plan.coarse.size(); ++i) {
    if (plan.coarse[i].level == ancestors.level) return data.coarse[i];
  }
  return data.params.level;
}

}  // namespace

BoundFrame bind(const ResolvedView& view, const VolumeInfo& info, const Plan& plan, const Pins& pins) {
  BoundFrame bound{.data = makeFrameData(view, info, plan)};
  gpu::FrameLevel* level = &bound.data.params.level;
  level->pages = gpu::kNone;
  std::size_t coarse = 0;
  for (std::size_t i = 0; i < plan.needs.size(); ++i) {
    if (coarse < plan.coarse.size() && i == plan.coarse[coarse].first_need) {
      level = &bound.data.coarse[coarse++];
      level->pages = gpu::kNone;
    }
    const Need& need = plan.needs[i];
    bindPart(need, plan, pins, need.part == Part::ancestors ? levelOf(need, plan, bound.data) : *level, bound);
  }
  return bound;
}

}  // namespace blockwalk
