// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/visible_quarters.h"

#include <algorithm>
#include <array>

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
      : kernels_(kernels),
        key_(key),
        range_(need.range),
        blocks_(std::move(blocks)),
        masks_(std::move(masks)),
        made_(std::make_unique<ResidentQuarters>()) {
    made_->quarters =
        Buffer(kernels.device_, std::uint64_t{masks_->count} * sizeof(std::uint64_t), BufferUse::resident);
  }

  std::unique_ptr<Resident> advance() override {
    const auto blocks = static_cast<std::uint32_t>(blocks_->voxels->records->blocks.size());
    const vk::raii::Pipeline& kernel = kernels_.pipeline(key_);
    const gpu::VisibleQuartersPush push{.blocks = blocks_->records.address(),
                                        .masks = masks_->records.address(),
                                        .quarters = made_->quarters.address(),
                                        .density_lo = range_.lo,
                                        .density_hi = range_.hi,
                                        .first_block = next_,
                                        .block_count = blocks,
                                        .subblock_count = masks_->count,
                                        .padding = 0};
    const std::uint32_t count = std::min(kBlocksASubmission, blocks - next_);
    kernels_.device_.submitAndWait([&](const vk::raii::CommandBuffer& commands) {
      commands.bindPipeline(vk::PipelineBindPoint::eCompute, *kernel);
      commands.pushConstants<gpu::VisibleQuartersPush>(*kernels_.layout_, vk::ShaderStageFlagBits::eCompute, 0, push);
      commands.dispatch(count, 1, 1);
    });
    next_ += count;
    if (next_ < blocks) return nullptr;
    return std::move(made_);
  }
  std::uint64_t bytes() const override { return made_ != nullptr ? made_->bytes() : 0; }

 private:
  VisibleQuarters& kernels_;
  Key key_;
  StoredRange range_;
  std::shared_ptr<const ResidentBlocks> blocks_;
  std::shared_ptr<const ResidentMasks> masks_;
  std::unique_ptr<ResidentQuarters> made_;
  std::uint32_t next_ = 0;
};

std::unique_ptr<Making> VisibleQuarters::make(const StoredVolume& volume, const Need& need,
                                              std::shared_ptr<const ResidentBlocks> blocks,
                                              std::shared_ptr<const ResidentMasks> masks) {
  const VolumeInfo& info = volume.file->info();
  const Key key{.voxel_type = static_cast<std::uint32_t>(info.type),
                .subblock_side = static_cast<std::uint32_t>(info.subblock_side),
                .apron = need.apron ? 1u : 0u};
  return std::make_unique<QuarterMaking>(*this, key, need, std::move(blocks), std::move(masks));
}

}  // namespace blockwalk
