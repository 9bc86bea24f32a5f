// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/paging.h"

#include "renderer/plan/aproned_layout.h"

namespace blockwalk {
namespace {

// Of what stays resident as a whole; it is drawn for a moment only.
constexpr std::uint64_t kCoarseShare = 4;

std::uint64_t deviceBytes(const VolumeInfo& info, const Plan& plan, int level, Form form) {
  const LevelInfo& of_level = info.level(level, form);
  const std::uint64_t subblocks = plan.apron ? of_level.apron_subblock_count : of_level.subblock_count;
  return subblocks * deviceSubblockBytes(info, plan.apron) * plan.channels.size();
}

// A maximum shows all that is there, and hides what is behind more than it should: a ray that ends where it first meets
// something is none the worse for that.
bool standsByMaximum(const ResolvedView& view) {
  if (view.mode == Mode::mip) return true;  // or a brighter voxel would be missed
  if (view.stand_in != StandIn::automatic) return view.stand_in == StandIn::maximum;
  return view.mode == Mode::first_hit || view.mode == Mode::iso;
}

}  // namespace

std::uint64_t voxelBytes(const VolumeInfo& info, const Plan& plan) {
  std::uint64_t bytes = deviceBytes(info, plan, plan.level, plan.form);
  for (const CoarsePlan& far : plan.coarse) {
    if (far.is_walked) bytes += deviceBytes(info, plan, far.level, far.form);
  }
  return bytes;
}

void choosePaging(const ResolvedView& view, const VolumeInfo& info, const DeviceTraits& device, Plan& plan) {
  const auto last = static_cast<int>(info.levels.size()) - 1;
  if (device.page_above_bytes == 0 || plan.level == last) return;
  if (voxelBytes(info, plan) <= device.page_above_bytes) return;
  CoarsePlan whole{.level = plan.level + 1};
  const auto form = [&] {
    return standsByMaximum(view) && info.has(whole.level, Form::maxima) ? Form::maxima : Form::values;
  };
  while (whole.level < last && deviceBytes(info, plan, whole.level, form()) > device.page_room_bytes / kCoarseShare) {
    ++whole.level;
  }
  whole.form = form();
  std::size_t stand_in = 0;
  const auto is_whole = [&](const CoarsePlan& far) { return far.level == whole.level && far.form == whole.form; };
  while (stand_in < plan.coarse.size() && !is_whole(plan.coarse[stand_in])) ++stand_in;
  if (stand_in == plan.coarse.size()) plan.coarse.push_back(whole);
  for (CoarsePlan& far : plan.coarse) far.paged = far.level < whole.level;
  plan.stand_in = stand_in;
  plan.key.paged = 1;
}

}  // namespace blockwalk
