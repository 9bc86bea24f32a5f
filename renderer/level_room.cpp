// SPDX-License-Identifier: Apache-2.0
#include "renderer/level_room.h"

#include <algorithm>

#include "renderer/plan/paging.h"

namespace blockwalk {

int LevelRoom::finestLevel(std::uint64_t volume) const {
  const auto found = finest_.find(volume);
  return found == finest_.end() ? 0 : found->second;
}

bool LevelRoom::giveWay(std::uint64_t volume, const VolumeInfo& info, const Plan& plan,
                        const OutOfDeviceMemory& shortage, bool any_level) {
  const int last = static_cast<int>(info.levels.size()) - 1;
  if (page_above_ == 0 || plan.is_blank || plan.level == last) return false;
  if (shortage.needed_bytes <= shortage.free_bytes) return false;
  const std::uint64_t bytes = voxelBytes(info, plan);
  if (!plan.isPaged()) {
    page_above_ = std::max<std::uint64_t>(1, std::min(page_above_, bytes - 1));
  } else {
    const int coarser = std::max(finestLevel(volume), plan.level) + 1;
    if (!any_level || coarser > last) return false;
    finest_[volume] = coarser;
  }
  largest_ = std::max(largest_, bytes);
  return true;
}

// A quarter more, for what a level needs besides voxels.
void LevelRoom::reconsider(std::uint64_t free_bytes) {
  if (largest_ == 0 || free_bytes / 5 * 4 < largest_) return;
  page_above_ = configured_;
  finest_.clear();
  largest_ = 0;
}

}  // namespace blockwalk
