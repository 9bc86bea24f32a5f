// SPDX-License-Identifier: Apache-2.0
// Which quarters of a level's subblocks may show something of a channel in a density range: 8 bytes a subblock, found
// by the device from the voxels (shaders/visible_quarters.comp) when a range is first asked for. With them a ray steps
// over what it cannot see, down to a quarter of a subblock's side.
#pragma once

#include <map>
#include <span>
#include <vulkan/vulkan_raii.hpp>

#include "renderer/resident/parts.h"

namespace blockwalk {

class VisibleQuarters {
 public:
  explicit VisibleQuarters(Device& device) : device_(device) {}

  // Part::visible_quarters, of the channel's blocks and masks: pieces of some blocks. It outlives the making.
  std::unique_ptr<Making> make(const StoredVolume& volume, const Need& need,
                               std::shared_ptr<const ResidentBlocks> blocks,
                               std::shared_ptr<const ResidentMasks> masks);
  // Of paged voxels: those of these blocks, ascending, whose voxels have come since.
  void refresh(const Need& need, const VolumeInfo& info, const ResidentQuarters& quarters,
               std::span<const std::uint32_t> blocks);

 private:
  class QuarterMaking;
  struct Key {
    std::uint32_t voxel_type = 0;
    std::uint32_t subblock_side = 0;
    std::uint32_t apron = 0;
    auto operator<=>(const Key&) const = default;
  };
  const vk::raii::Pipeline& pipeline(const Key& key);
  void record(const vk::raii::CommandBuffer& commands, const vk::raii::Pipeline& kernel,
              const ResidentQuarters& quarters, std::uint32_t first, std::uint32_t count) const;
  static Key keyOf(const Need& need, const VolumeInfo& info);

  Device& device_;
  vk::raii::PipelineLayout layout_{nullptr};
  std::map<Key, vk::raii::Pipeline> pipelines_;
};

}  // namespace blockwalk
