// SPDX-License-Identifier: Apache-2.0
#include "renderer/level_room.h"

#include <algorithm>
#include <limits>

#include "renderer/plan/level_choice.h"
#include "renderer/plan/level_window.h"
#include "renderer/plan/paging.h"

namespace blockwalk {

std::uint64_t LevelRoom::pageAboveBytes(std::uint64_t volume) const {
  const auto given = of_volumes_.find(volume);
  return given == of_volumes_.end() ? page_above_ : given->second.page_above;
}

int LevelRoom::finestLevel(std::uint64_t volume) const {
  const auto given = of_volumes_.find(volume);
  return given == of_volumes_.end() ? 0 : given->second.finest;
}

std::uint64_t LevelRoom::mostWindowCells(std::uint64_t volume) const {
  const auto given = of_volumes_.find(volume);
  return given == of_volumes_.end() ? std::numeric_limits<std::uint64_t>::max() : given->second.window_cells;
}

LevelShortage LevelRoom::shortage(std::uint64_t volume) const {
  const auto given = of_volumes_.find(volume);
  return given == of_volumes_.end() ? LevelShortage{} : given->second.shortage;
}

bool LevelRoom::giveWay(std::uint64_t volume, const VolumeInfo& info, const ResolvedView& view, const Plan& plan,
                        const OutOfDeviceMemory& shortage) {
  const int last = static_cast<int>(info.levels.size()) - 1;
  if (page_above_ == 0 || plan.is_blank || plan.level == last) return false;
  if (shortage.needed_bytes <= shortage.free_bytes) return false;
  const std::uint64_t bytes = voxelBytes(info, plan);
  Given given{.page_above = pageAboveBytes(volume),
              .finest = finestLevel(volume),
              .window_cells = mostWindowCells(volume),
              .largest = bytes,
              .shortage = {.needed = shortage.needed_bytes, .free = shortage.free_bytes}};
  if (!plan.isPaged()) {
    given.page_above = std::max<std::uint64_t>(1, std::min(given.page_above, bytes - 1));
  } else {
    // Of some modes no coarser level will do.
    const int coarser = std::max(given.finest, plan.level) + 1;
    if (view.level != kAutoLevel || coarser > last || drawnLevel(view, info, coarser) <= plan.level) return false;
    // Another view's window may be a smaller one.
    if (const std::uint64_t cells = windowCells(plan); cells > 0) {
      given.window_cells = std::min(given.window_cells, cells);
    } else {
      given.finest = coarser;
    }
  }
  Given& known = of_volumes_[volume];
  given.largest = std::max(given.largest, known.largest);
  if (given.window_cells < std::numeric_limits<std::uint64_t>::max() && given.finest == 0) {
    given.largest = shortage.needed_bytes;
  }
  known = given;
  return true;
}

// A quarter more, for what a level needs besides voxels.
void LevelRoom::reconsider(std::uint64_t free_bytes) {
  std::erase_if(of_volumes_, [&](const auto& given) { return free_bytes / 5 * 4 >= given.second.largest; });
}

}  // namespace blockwalk
