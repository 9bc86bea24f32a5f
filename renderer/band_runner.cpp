// SPDX-License-Identifier: Apache-2.0
#include "renderer/band_runner.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace blockwalk {
namespace {

enum Timestamp : std::uint32_t { kBandBegin, kBandEnd, kTimestampCount };

// lavapipe gives each of its threads one run of a dispatch's workgroups, as many to each, and waits for the slowest.
// What is far apart in the dispatch therefore lies side by side in the picture, where rays cost about the same: the
// stride is near the golden section of the rows, and coprime to them, so that every run of rows is spread over the
// whole band. Hardware hands out workgroups as it goes, and gains by neighbours.
std::uint32_t spreadStride(std::uint32_t rows) {
  auto stride = std::max(1u, static_cast<std::uint32_t>(0.6180339887 * rows));
  while (std::gcd(stride, rows) != 1) ++stride;
  return stride;
}

}  // namespace

int wholeGroups(int pixels) { return (pixels + gpu::kGroupSide - 1) / gpu::kGroupSide * gpu::kGroupSide; }

BandRunner::BandRunner(Device& device, Kernels& kernels) : device_(device), kernels_(kernels) {
  const auto& handle = device.handle();
  pool_ = handle.createCommandPool(
      {.flags = vk::CommandPoolCreateFlagBits::eResetCommandBuffer, .queueFamilyIndex = device.queueFamily()});
  commands_ = std::move(handle.allocateCommandBuffers({.commandPool = *pool_, .commandBufferCount = 1})[0]);
  timestamps_ = handle.createQueryPool({.queryType = vk::QueryType::eTimestamp, .queryCount = kTimestampCount});
  fence_ = handle.createFence({});
}

void BandRunner::record(const Kernels::Kernel& kernel, const Plan& plan, const Band& band, std::uint64_t params,
                        vk::DescriptorSet instances) {
  const bool ray_query = plan.key.queriesRays();
  commands_.bindPipeline(vk::PipelineBindPoint::eCompute, **kernel.pipeline);
  const auto& layout = kernels_.layout(ray_query);
  if (kernel.general) {
    commands_.pushConstants<KernelKey>(*layout, vk::ShaderStageFlagBits::eCompute, kChoicesOffset, plan.key);
  }
  if (ray_query) commands_.bindDescriptorSets(vk::PipelineBindPoint::eCompute, *layout, 0, instances, {});
  const auto groups = [](int pixels) { return static_cast<std::uint32_t>(wholeGroups(pixels) / gpu::kGroupSide); };
  const std::uint32_t row_stride = device_.isSoftware() ? spreadStride(groups(band.row_count)) : 1;
  // A sample adds to the sums and pixels that the one before has written, in this submission or an earlier one.
  const auto shader = vk::AccessFlagBits::eShaderWrite;
  const vk::MemoryBarrier to_next{.srcAccessMask = shader, .dstAccessMask = shader | vk::AccessFlagBits::eShaderRead};
  for (int i = 0; i < band.sample_count; ++i) {
    const int sample = band.sample_begin + i;
    if (sample > 0) {
      commands_.pipelineBarrier(vk::PipelineStageFlagBits::eComputeShader, vk::PipelineStageFlagBits::eComputeShader,
                                {}, to_next, {}, {});
    }
    const gpu::PushConstants push{.frame = params,
                                  .row_begin = band.row_begin,
                                  .row_count = band.row_count,
                                  .sample_index = static_cast<gpu::uint>(sample),
                                  .row_stride = row_stride};
    commands_.pushConstants<gpu::PushConstants>(*layout, vk::ShaderStageFlagBits::eCompute, 0, push);
    commands_.dispatchBase(static_cast<std::uint32_t>(band.column_begin / gpu::kGroupSide), 0, 0,
                           groups(band.column_count), groups(band.row_count), 1);
  }
}

double BandRunner::run(const Kernels::Kernel& kernel, const Plan& plan, const Band& band, std::uint64_t params,
                       vk::DescriptorSet instances) {
  timestamps_.reset(0, kTimestampCount);
  commands_.reset();
  commands_.begin({.flags = vk::CommandBufferUsageFlagBits::eOneTimeSubmit});
  commands_.writeTimestamp(vk::PipelineStageFlagBits::eTopOfPipe, *timestamps_, kBandBegin);
  record(kernel, plan, band, params, instances);
  const vk::MemoryBarrier to_host{.srcAccessMask = vk::AccessFlagBits::eShaderWrite,
                                  .dstAccessMask = vk::AccessFlagBits::eHostRead};
  commands_.pipelineBarrier(vk::PipelineStageFlagBits::eComputeShader, vk::PipelineStageFlagBits::eHost, {}, to_host,
                            {}, {});
  commands_.writeTimestamp(vk::PipelineStageFlagBits::eBottomOfPipe, *timestamps_, kBandEnd);
  commands_.end();
  device_.handle().resetFences(*fence_);
  device_.submit(commands_, *fence_);
  device_.wait(*fence_);
  const auto [result, ticks] = timestamps_.getResults<std::uint64_t>(
      0, kTimestampCount, kTimestampCount * sizeof(std::uint64_t), sizeof(std::uint64_t), vk::QueryResultFlagBits::e64);
  const std::uint64_t elapsed = (ticks[kBandEnd] - ticks[kBandBegin]) & device_.timestampMask();
  return static_cast<double>(elapsed) * device_.timestampPeriodNs() * 1e-6;
}

}  // namespace blockwalk
