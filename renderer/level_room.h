// SPDX-License-Identifier: Apache-2.0
// Which levels of which volumes have found no room on the device, and what is done instead: voxels that find none as a
// whole come and go; where what else a level needs finds none either, `auto` is a coarser one. Until there is clearly
// room again.
#pragma once

#include <cstdint>
#include <limits>
#include <map>

#include "renderer/plan/plan.h"
#include "view/device_info.h"

namespace blockwalk {

// Bytes that a level needed, and that were free for it.
struct LevelShortage {
  std::uint64_t needed = 0;
  std::uint64_t free = 0;
};

class LevelRoom {
 public:
  // `page_above_bytes`: voxels of a level that take more come and go from the start; 0: never any.
  explicit LevelRoom(std::uint64_t page_above_bytes) : page_above_(page_above_bytes) {}

  std::uint64_t pageAboveBytes(std::uint64_t volume) const;
  int finestLevel(std::uint64_t volume) const;
  // Of a level whose records are read by windows: a window of so many blocks found none.
  std::uint64_t mostWindowCells(std::uint64_t volume) const;
  // Of what found none last.
  LevelShortage shortage(std::uint64_t volume) const;

  // Whether the plan, of which a part found no room, needs less when it is made anew. What fails though there is room,
  // as a device does now and then, is no reason.
  bool giveWay(std::uint64_t volume, const VolumeInfo& info, const ResolvedView& view, const Plan& plan,
               const OutOfDeviceMemory& shortage);
  bool hasGivenWay() const { return !of_volumes_.empty(); }
  // So many bytes could be taken: where all of a volume that found no room once would find it, it may try again.
  void reconsider(std::uint64_t free_bytes);
  void forget(std::uint64_t volume) { of_volumes_.erase(volume); }

 private:
  struct Given {
    std::uint64_t page_above = 0;
    int finest = 0;
    std::uint64_t window_cells = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t largest = 0;  // voxels of what found no room
    LevelShortage shortage{};
  };

  std::uint64_t page_above_;
  std::map<std::uint64_t, Given> of_volumes_;
};

}  // namespace blockwalk
