// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/visible_quarters.h"

#include <algorithm>
#include <array>

#include "renderer/resident/pages.h"
#include "renderer/vulkan/side_kernel.h"
#include "shaders/kernel_interface.h"
#include "visible_quarters.spv.h"

namespace blockwalk {
namespace {

constexpr std::uint32_t kBlocksASubmission = 1024;  // no dispatch is long

}  // namespace

const vk::raii::Pipeline& VisibleQuarters::pipeline(const Key& key) {
  const auto found = pipelines_.find(key);
  if (found != pipelines_.end()) return found->second;
  if (!*layout_) layout_ = makePushLayout(device_, sizeof(gpu::VisibleQuartersPush));
  const std::array constants{key.voxel_type, key.subblock_side, key.apron};
  return pipelines_.emplace(key, makeSideKernel(device_, visible_quarters_spirv, constants, layout_)).first->second;
}

class VisibleQuarters::QuarterMaking final : public Making {
 public:
  QuarterMaking(VisibleQuarters& kernels, const Key& key, const Need& need,
                std::shared_ptr<const ResidentBlocks> blocks, std::shared_ptr<const ResidentMasks> masks)
      : kernels_(kernels), key_(key), made_(std::make_unique<ResidentQuarters>()) {
    made_->range = need.range;
    made_->blocks = std::move(blocks);
    made_->masks = std::move(masks);
    made_->quarters =
        Buffer(kernels.device_, std::uint64_t{made_->masks->count} * sizeof(std::uint64_t), BufferUse::resident);
  }

  std::unique_ptr<Resident> advance() override {
    const auto blocks = static_cast<std::uint32_t>(made_->blocks->voxels->records->blocks.size());
    const std::uint32_t count = std::min(kBlocksASubmission, blocks - next_);
    const vk::raii::Pipeline& kernel = kernels_.pipeline(key_);
    kernels_.device_.submitAndWait(
        [&](const vk::raii::CommandBuffer& commands) { kernels_.record(commands, kernel, *made_, next_, count); });
    next_ += count;
    if (next_ < blocks) return nullptr;
    if (PagedVoxels* const pages = made_->blocks->voxels->pages.get()) pages->follow(made_.get());
    return std::move(made_);
  }
  std::uint64_t bytes() const override { return made_ != nullptr ? made_->bytes() : 0; }

 private:
  VisibleQuarters& kernels_;
  Key key_;
  std::unique_ptr<ResidentQuarters> made_;
  std::uint32_t next_ = 0;
};

void VisibleQuarters::record(const vk::raii::CommandBuffer& commands, const vk::raii::Pipeline& kernel,
                             const ResidentQuarters& quarters, std::uint32_t first, std::uint32_t count) const {
  const gpu::VisibleQuartersPush push{
      .blocks = quarters.blocks->records.address(),
      .masks = quarters.masks->records.address(),
      .quarters = quarters.quarters.address(),
      .density_lo = quarters.range.lo,
      .density_hi = quarters.range.hi,
      .first_block = first,
      .block_count = static_cast<std::uint32_t>(quarters.blocks->voxels->records->blocks.size()),
      .subblock_count = quarters.masks->count,
      .padding = 0};
  commands.bindPipeline(vk::PipelineBindPoint::eCompute, *kernel);
  commands.pushConstants<gpu::VisibleQuartersPush>(*layout_, vk::ShaderStageFlagBits::eCompute, 0, push);
  commands.dispatch(count, 1, 1);
}

void VisibleQuarters::refresh(const Need& need, const VolumeInfo& info, const ResidentQuarters& quarters,
                              std::span<const std::uint32_t> blocks) {
  if (blocks.empty()) return;
  const vk::raii::Pipeline& kernel = pipeline(keyOf(need, info));
  device_.submitAndWait([&](const vk::raii::CommandBuffer& commands) {
    for (std::size_t i = 0; i < blocks.size();) {
      std::size_t end = i + 1;
      while (end < blocks.size() && blocks[end] == blocks[i] + (end - i)) ++end;
      record(commands, kernel, quarters, blocks[i], static_cast<std::uint32_t>(end - i));
      i = end;
    }
  });
}

VisibleQuarters::Key VisibleQuarters::keyOf(const Need& need, const VolumeInfo& info) {
  return {.voxel_type = static_cast<std::uint32_t>(info.type),
          .subblock_side = static_cast<std::uint32_t>(info.subblock_side),
          .apron = need.apron ? 1u : 0u};
}

std::unique_ptr<Making> VisibleQuarters::make(const StoredVolume& volume, const Need& need,
                                              std::shared_ptr<const ResidentBlocks> blocks,
                                              std::shared_ptr<const ResidentMasks> masks) {
  const Key key = keyOf(need, volume.file->info());
  return std::make_unique<QuarterMaking>(*this, key, need, std::move(blocks), std::move(masks));
}

}  // namespace blockwalk
