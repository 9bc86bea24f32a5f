// SPDX-License-Identifier: Apache-2.0
#include "renderer/frame_buffers.h"

#include "shaders/kernel_interface.h"
#include "view/frame_order.h"

namespace blockwalk {
namespace {

// As many as are usually under way at once.
constexpr std::size_t kMostIdle = 4;

}  // namespace

FrameBuffers FrameBufferPool::take(const Sizes& sizes) {
  FrameBuffers buffers;
  if (!idle_.empty()) {
    buffers = std::move(idle_.front());
    idle_.pop_front();
  }
  growTo(device_, buffers.params, sizeof(gpu::FrameData), BufferUse::upload);
  growTo(device_, buffers.counters, sizeof(gpu::GpuCounters), BufferUse::readback);
  growTo(device_, buffers.pixels, sizes.pixels * sizeof(std::uint32_t), BufferUse::readback);
  if (sizes.sums) growTo(device_, buffers.sums, sizes.pixels * kSumBytes, BufferUse::resident);
  if (sizes.probes) growTo(device_, buffers.probes, sizes.pixels * sizeof(gpu::GpuProbe), BufferUse::readback);
  if (sizes.wanted_words > 0) {
    growTo(device_, buffers.wanted, sizes.wanted_words * sizeof(std::uint32_t), BufferUse::readback);
    growTo(device_, buffers.next_samples, sizes.pixels * sizeof(std::uint32_t), BufferUse::resident);
  }
  return buffers;
}

void FrameBufferPool::give(FrameBuffers buffers) noexcept {
  if (idle_.size() == kMostIdle) idle_.pop_back();
  try {
    idle_.push_front(std::move(buffers));
  } catch (const std::bad_alloc&) {  // no memory to remember it by: it goes back to the device
  }
}

}  // namespace blockwalk
