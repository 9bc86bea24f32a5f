// SPDX-License-Identifier: Apache-2.0
#include "renderer/part_maker.h"

#include "renderer/find/finder_parts.h"
#include "renderer/resident/paged_making.h"
#include "renderer/resident/records.h"
#include "renderer/resident/voxels.h"

namespace blockwalk {
namespace {

// Another part of the same level and channel.
Need sibling(const Need& need, Part part) {
  return {.part = part,
          .level = need.level,
          .form = need.form,
          .window = need.window,
          .paged = need.paged,
          .apron = need.apron,
          .channel = need.channel};
}

Need ofLevel(const Need& need, Part part) {
  Need level = sibling(need, part);
  level.channel = Need::kAllChannels;
  return level;
}

// Of the budget. The rest is for records, what stands in for absent voxels, finders and frames.
std::uint64_t pageBytes(const Device& device, const DeviceOptions& options) {
  return options.page_bytes.value_or(device.info().memory_budget_bytes / 8 * 5);
}

}  // namespace

PartMaker::PartMaker(Device& device, const DeviceOptions& options)
    : device_(device),
      chunk_bytes_(options.chunk_bytes),
      visible_quarters_(device),
      pages_(pageBytes(device, options)),
      regions_(device, options.piece_macrocells) {
  if (device.rayQuery()) unit_box_ = buildUnitBox(device);
}

std::unique_ptr<Making> PartMaker::begin(const StoredVolume& volume, const Need& need, const Pins& inputs) {
  const auto voxels = [&] { return inputs.share<ResidentVoxels>(sibling(need, Part::voxels)); };
  const auto any_voxels = [&] { return inputs.shareAnyVoxels<ResidentVoxels>(need); };
  const auto blocks = [&] { return inputs.share<ResidentBlocks>(sibling(need, Part::blocks)); };
  const auto masks = [&] { return inputs.share<ResidentMasks>(sibling(need, Part::masks)); };
  switch (need.part) {
    case Part::voxels:
      if (need.paged) return makePagedVoxels(device_, pages_, visible_quarters_, volume, need);
      return makeVoxels(device_, volume, need, chunk_bytes_);
    case Part::blocks:
      return makeBlocks(device_, volume, voxels());
    case Part::masks:
      return makeMasks(device_, volume, need, voxels());
    case Part::visible_quarters:
      return visible_quarters_.make(volume, need, blocks(), masks());
    case Part::empty:
      return makeEmpty(device_, volume, need);
    case Part::table:
      return makeTable(device_, volume, need);
    case Part::grid:
      return makeGrid(device_, volume, any_voxels());
    case Part::octree:
      return makeOctree(device_, volume, need, any_voxels());
    case Part::instances:
      return makeInstances(device_, volume, unit_box_, any_voxels());
    case Part::macrocells:
      return regions_.makeMacrocells(volume, need, blocks(), masks(),
                                     inputs.share<ResidentGrid>(ofLevel(need, Part::grid)));
    case Part::clusters:
    case Part::boundary:
      return beginRegion(volume, need, inputs);
    case Part::ancestors: {
      Need coarse = need;
      coarse.level = need.coarse_level;
      coarse.form = need.coarse_form;
      coarse.window = {};
      coarse.paged = false;
      return makeAncestors(device_, need, any_voxels(), inputs.shareAnyVoxels<ResidentVoxels>(coarse));
    }
    case Part::sums:
      break;  // frames make them
  }
  BLOCKWALK_CHECK(static_cast<int>(need.part), !=, static_cast<int>(Part::sums));
  return nullptr;
}

std::unique_ptr<Making> PartMaker::beginRegion(const StoredVolume& volume, const Need& need, const Pins& inputs) {
  std::vector<std::shared_ptr<const ResidentMacrocells>> macrocells;
  for (const RegionChannel& drawn : need.region) {
    Need of_channel = ofLevel(need, Part::macrocells);
    of_channel.channel = drawn.channel;
    of_channel.macrocell_voxels = need.macrocell_voxels;
    macrocells.push_back(inputs.share<ResidentMacrocells>(of_channel));
  }
  return regions_.makeRegion(volume, need, std::move(macrocells));
}

}  // namespace blockwalk
