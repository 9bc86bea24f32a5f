// SPDX-License-Identifier: Apache-2.0
// Which levels have found no room on the device, and what is done instead: voxels that find none as a whole come and
// go; where what else a level needs finds none either, `auto` is a coarser one. Until there is clearly room again.
#pragma once

#include <cstdint>
#include <map>

#include "renderer/plan/plan.h"
#include "view/device_info.h"

namespace blockwalk {

class LevelRoom {
 public:
  // `page_above_bytes`: voxels of a level that take more come and go from the start; 0: never any.
  explicit LevelRoom(std::uint64_t page_above_bytes) : configured_(page_above_bytes), page_above_(page_above_bytes) {}

  std::uint64_t pageAboveBytes() const { return page_above_; }
  int finestLevel(std::uint64_t volume) const;

  // Whether the plan, of which a part found no room, needs less when it is made anew. `any_level`: the view leaves the
  // level to us. What fails though there is room, as a device does now and then, is no reason.
  bool giveWay(std::uint64_t volume, const VolumeInfo& info, const Plan& plan, const OutOfDeviceMemory& shortage,
               bool any_level);
  bool hasGivenWay() const { return largest_ > 0; }
  // So many bytes could be taken: where all that found no room once would find it, it may try again.
  void reconsider(std::uint64_t free_bytes);
  void forget(std::uint64_t volume) { finest_.erase(volume); }

 private:
  std::uint64_t configured_;
  std::uint64_t page_above_;
  std::map<std::uint64_t, int> finest_;  // of volumes, where it is not 0
  std::uint64_t largest_ = 0;            // voxels of what found no room
};

}  // namespace blockwalk
