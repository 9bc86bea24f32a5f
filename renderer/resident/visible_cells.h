// SPDX-License-Identifier: Apache-2.0
// Which cells of a level's subblocks may show something of a channel in a density range: 8 bytes a subblock, found by
// the device from the voxels (shaders/visible_cells.comp) when a range is first asked for. With them a ray steps over
// what it cannot see down to an eighth of a subblock's side squared.
#pragma once

#include <map>
#include <vulkan/vulkan_raii.hpp>

#include "renderer/plan/plan.h"
#include "renderer/resident/resident_volume.h"

namespace blockwalk {

class VisibleCells {
 public:
  explicit VisibleCells(Device& device) : device_(device) {}

  // Of channel `drawn` of a resident level, with the ring or without. The range is what the volume's densities are
  // compared with on the device. Kept with the channel: going back to one of its last ranges costs nothing.
  const Buffer& find(VulkanVolume& volume, const Plan& plan, ResidentChannel& channel, StoredRange range);

 private:
  struct Key {
    std::uint32_t voxel_type = 0;
    std::int32_t subblock_side = 0;
    std::uint32_t apron = 0;
    auto operator<=>(const Key&) const = default;
  };
  const vk::raii::Pipeline& pipeline(const Key& key);

  Device& device_;
  vk::raii::PipelineLayout layout_{nullptr};
  std::map<Key, vk::raii::Pipeline> pipelines_;
};

}  // namespace blockwalk
