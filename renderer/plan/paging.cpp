// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/paging.h"

#include "renderer/plan/aproned_layout.h"

namespace blockwalk {
namespace {

// Of what stays resident as a whole; it is drawn for a moment only.
constexpr std::uint64_t kCoarseShare = 8;

std::uint64_t deviceBytes(const VolumeInfo& info, const Plan& plan, int level, Form form) {
  const LevelInfo& of_level = info.level(level, form);
  const std::uint64_t subblocks = plan.apron ? of_level.apron_subblock_count : of_level.subblock_count;
  return subblocks * deviceSubblockBytes(info, plan.apron) * plan.channels.size();
}

}  // namespace

std::uint64_t voxelBytes(const VolumeInfo& info, const Plan& plan) {
  return deviceBytes(info, plan, plan.level, plan.form);
}

void choosePaging(const ResolvedView& view, const VolumeInfo& info, const DeviceTraits& device, Plan& plan) {
  const auto last = static_cast<int>(info.levels.size()) - 1;
  if (device.page_above_bytes == 0 || plan.level == last) return;
  if (voxelBytes(info, plan) <= device.page_above_bytes) return;
  int level = plan.level + 1;
  const auto form = [&] {
    return view.mode == Mode::mip && info.has(level, Form::maxima) ? Form::maxima : Form::values;
  };
  while (level < last && deviceBytes(info, plan, level, form()) > device.page_room_bytes / kCoarseShare) ++level;
  plan.coarse_level = level;
  plan.coarse_form = form();
  plan.key.paged = 1;
}

}  // namespace blockwalk
