// SPDX-License-Identifier: Apache-2.0
// Begins the making of every kind of part: what it is made of is found among the parts that were needed before it.
#pragma once

#include "renderer/find/active_region.h"
#include "renderer/resident/pages.h"

namespace blockwalk {

class PartMaker {
 public:
  // Of the options its sizes of chunks and pieces.
  PartMaker(Device& device, const DeviceOptions& options);

  // Residency::Begin. It outlives what it makes.
  std::unique_ptr<Making> begin(const StoredVolume& volume, const Need& need, const Pins& inputs);
  PagePool& pagePool() { return pages_; }
  // Memory that the next making would begin with goes back.
  void dropSpare() { regions_.dropSpare(); }

 private:
  std::unique_ptr<Making> beginRegion(const StoredVolume& volume, const Need& need, const Pins& inputs);

  Device& device_;
  std::uint64_t chunk_bytes_;
  AccelerationStructure unit_box_;
  VisibleQuarters visible_quarters_;
  PagePool pages_;
  ActiveRegions regions_;
};

}  // namespace blockwalk
