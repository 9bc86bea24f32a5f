// SPDX-License-Identifier: Apache-2.0
#include "renderer/resident/pins.h"

#include <algorithm>

#include "volume/error.h"

namespace blockwalk {

const std::shared_ptr<const Slot>& Pins::find(const Need& need) const {
  const auto found = std::ranges::find(pins_, need, &Pin::need);
  BLOCKWALK_CHECK(found - pins_.begin(), <, std::ssize(pins_));
  return found->slot;
}

std::shared_ptr<const Slot> Pins::voxelsOf(const Need& of_level) const {
  const auto found = std::ranges::find_if(pins_, [&](const Pin& pin) {
    return pin.need.part == Part::voxels && pin.need.level == of_level.level && pin.need.form == of_level.form &&
           pin.need.window == of_level.window && pin.need.apron == of_level.apron && pin.need.paged == of_level.paged;
  });
  return found == pins_.end() ? nullptr : found->slot;
}

}  // namespace blockwalk
