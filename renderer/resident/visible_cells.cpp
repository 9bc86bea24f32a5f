// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/visible_cells.h"

#include <algorithm>
#include <array>

#include "visible_cells.spv.h"

namespace blockwalk {
namespace {

constexpr std::size_t kKeptRanges = 4;              // of a channel
constexpr std::uint32_t kBlocksASubmission = 1024;  // no dispatch is long

}  // namespace

const vk::raii::Pipeline& VisibleCells::pipeline(const Key& key) {
  const auto found = pipelines_.find(key);
  if (found != pipelines_.end()) return found->second;
  const auto& handle = device_.handle();
  if (!*layout_) {
    const vk::PushConstantRange push{
        .stageFlags = vk::ShaderStageFlagBits::eCompute, .offset = 0, .size = sizeof(gpu::VisibleCellsPush)};
    layout_ = handle.createPipelineLayout(vk::PipelineLayoutCreateInfo{}.setPushConstantRanges(push));
  }
  const vk::raii::ShaderModule module =
      handle.createShaderModule({.codeSize = sizeof visible_cells_spirv, .pCode = visible_cells_spirv});
  std::array<vk::SpecializationMapEntry, 3> entries;
  for (std::uint32_t i = 0; i < entries.size(); ++i)
    entries[i] = vk::SpecializationMapEntry{.constantID = i, .offset = i * 4, .size = 4};
  const vk::SpecializationInfo specialisation{
      .mapEntryCount = entries.size(), .pMapEntries = entries.data(), .dataSize = sizeof key, .pData = &key};
  return pipelines_
      .emplace(key, handle.createComputePipeline(
                        nullptr, vk::ComputePipelineCreateInfo{.stage = {.stage = vk::ShaderStageFlagBits::eCompute,
                                                                         .module = *module,
                                                                         .pName = "main",
                                                                         .pSpecializationInfo = &specialisation},
                                                               .layout = *layout_}))
      .first->second;
}

const Buffer& VisibleCells::find(VulkanVolume& volume, const Plan& plan, ResidentChannel& channel, StoredRange range) {
  const auto known = std::ranges::find(channel.visible_cells, range, &ResidentCells::range);
  if (known != channel.visible_cells.end()) {
    std::rotate(channel.visible_cells.begin(), known, known + 1);
    return channel.visible_cells.front().cells;
  }
  const VolumeInfo& info = volume.info();
  const std::uint64_t masks = volume.masks(channel).address();
  const auto subblocks = static_cast<std::uint32_t>(channel.masks.bytes() / sizeof(gpu::GpuSubblock));
  const auto blocks = static_cast<std::uint32_t>(channel.blocks.bytes() / sizeof(gpu::GpuBlock));
  ResidentCells made{.range = range,
                     .cells = Buffer(device_, std::uint64_t{subblocks} * sizeof(std::uint64_t), BufferUse::resident)};
  const vk::raii::Pipeline& kernel = pipeline({.voxel_type = static_cast<std::uint32_t>(info.type),
                                               .subblock_side = info.subblock_side,
                                               .apron = plan.needs_apron ? 1u : 0u});
  for (std::uint32_t first = 0; first < blocks; first += kBlocksASubmission) {
    const gpu::VisibleCellsPush push{.blocks = channel.blocks.address(),
                                     .masks = masks,
                                     .cells = made.cells.address(),
                                     .density_lo = range.lo,
                                     .density_hi = range.hi,
                                     .first_block = first,
                                     .block_count = blocks,
                                     .subblock_count = subblocks,
                                     .padding = 0};
    device_.submitAndWait([&](const vk::raii::CommandBuffer& commands) {
      commands.bindPipeline(vk::PipelineBindPoint::eCompute, *kernel);
      commands.pushConstants<gpu::VisibleCellsPush>(*layout_, vk::ShaderStageFlagBits::eCompute, 0, push);
      commands.dispatch(std::min(kBlocksASubmission, blocks - first), 1, 1);
    });
  }
  if (channel.visible_cells.size() == kKeptRanges) channel.visible_cells.pop_back();
  channel.visible_cells.insert(channel.visible_cells.begin(), std::move(made));
  return channel.visible_cells.front().cells;
}

}  // namespace blockwalk
