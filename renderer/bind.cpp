// SPDX-License-Identifier: Apache-2.0
#include "renderer/bind.h"

#include <algorithm>
#include <span>

#include "renderer/plan/frame_params.h"
#include "renderer/resident/parts.h"

namespace blockwalk {
namespace {

// Of the level that is drawn, or of the coarser one.
using Channels = std::span<gpu::DrawnChannel, gpu::kMaxDrawnChannels>;

gpu::DrawnChannel& channelOf(const Need& need, const Plan& plan, Channels channels) {
  const auto found = std::ranges::find(plan.channels, static_cast<std::size_t>(need.channel), &ChannelPlan::channel);
  return channels[static_cast<std::size_t>(found - plan.channels.begin())];
}

void bindTable(const ResidentTable& table, gpu::DrawnChannel& params) {
  params.table = table.entries.address();
  params.integrals = table.integrals.address();
  params.table_scale = table.scale;
  params.table_first = table.first;
  params.table_last = table.last;
}

void bindRegion(const ResidentRegion& region, const Need& need, BoundFrame& bound) {
  bound.params.macrocell_states = region.states.address();
  bound.params.boxes = region.boxes.address();
  bound.params.macrocell_dims = region.macrocell_dims;
  bound.params.macrocell_voxels = static_cast<float>(need.macrocell_voxels);
  bound.build = region.build;
  bound.instances = *region.top.handle;
}

void bindPart(const Need& need, const Plan& plan, const Pins& pins, Channels channels, BoundFrame& bound) {
  gpu::FrameParams& params = bound.params;
  switch (need.part) {
    case Part::blocks:
      channelOf(need, plan, channels).blocks = pins.get<ResidentBlocks>(need).records.address();
      return;
    case Part::visible_quarters:
      channelOf(need, plan, channels).quarters = pins.get<ResidentQuarters>(need).quarters.address();
      return;
    case Part::empty:
      channelOf(need, plan, channels).empty = pins.get<ResidentEmpty>(need).voxels.address();
      return;
    case Part::table:
      return bindTable(pins.get<ResidentTable>(need), channelOf(need, plan, channels));
    case Part::grid: {
      const auto& grid = pins.get<ResidentGrid>(need);
      params.grid_tiles = grid.tiles.address();
      params.grid_blocks = grid.blocks.address();
      params.tile_dims = grid.tile_dims;
      return;
    }
    case Part::octree:
      params.octree = pins.get<ResidentOctree>(need).nodes.address();
      params.octree_depth = pins.get<ResidentOctree>(need).depth;
      return;
    case Part::instances:
      bound.instances = *pins.get<ResidentInstances>(need).top.handle;
      return;
    case Part::clusters:
    case Part::boundary:
      return bindRegion(pins.get<ResidentRegion>(need), need, bound);
    case Part::ancestors:
      params.ancestors = pins.get<ResidentAncestors>(need).blocks.address();
      return;
    case Part::voxels:  // by the records of blocks
    case Part::masks:   // what is made of them
    case Part::macrocells:
    case Part::sums:
      return;
  }
}

}  // namespace

BoundFrame bind(const ResolvedView& view, const VolumeInfo& info, const Plan& plan, const Pins& pins) {
  BoundFrame bound{.params = makeFrameParams(view, info, plan)};
  const std::span needs(plan.needs);
  const std::size_t own = needs.size() - plan.coarse_needs;
  for (const Need& need : needs.first(own)) bindPart(need, plan, pins, bound.params.channels, bound);
  for (const Need& need : needs.subspan(own)) bindPart(need, plan, pins, bound.params.coarse, bound);
  return bound;
}

}  // namespace blockwalk
