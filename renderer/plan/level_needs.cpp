// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/level_needs.h"

#include <algorithm>

#include "renderer/plan/aproned_layout.h"
#include "shaders/kernel_interface.h"

namespace blockwalk {
namespace {

constexpr std::uint64_t kQuarterBytes = 8;

}  // namespace

LevelNeeds levelNeeds(const VolumeInfo& info, const LevelInfo& level) {
  const std::uint64_t channels = info.channels.size();
  const std::uint64_t with_apron = std::max(level.subblock_count, level.apron_subblock_count);
  return {.nearest_bytes = channels * level.subblock_count * deviceSubblockBytes(info, false),
          .linear_bytes = channels * with_apron * deviceSubblockBytes(info, true),
          .record_bytes = channels * (level.block_count * sizeof(gpu::GpuBlock) +
                                      with_apron * (sizeof(gpu::GpuSubblock) + kQuarterBytes))};
}

}  // namespace blockwalk
