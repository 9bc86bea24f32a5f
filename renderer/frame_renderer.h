// SPDX-License-Identifier: Apache-2.0
// Orders become frames under way: each is planned, after the finder was chosen where that is left to us, and drawn
// piece by piece (renderer/planned_frame.h).
#pragma once

#include "renderer/finder_choice.h"
#include "renderer/level_room.h"
#include "renderer/part_maker.h"
#include "renderer/planned_frame.h"

namespace blockwalk {

class FrameRenderer {
 public:
  FrameRenderer(Device& device, const DeviceOptions& options);
  ~FrameRenderer();
  FrameRenderer(const FrameRenderer&) = delete;
  FrameRenderer& operator=(const FrameRenderer&) = delete;

  std::unique_ptr<VulkanVolume> load(VolumeFile file);
  // Throws ViewError where the device cannot do what is asked.
  std::unique_ptr<FrameInProgress> begin(VulkanVolume& volume, FrameOrder order);

  const Residency& residency() const { return tools_.residency; }
  void forget(std::uint64_t owner) { tools_.kept_sums.forget(owner); }

 private:
  class OrderedFrame;
  DeviceTraits traits(const VulkanStep& volume) const;
  bool shouldProbe(const FrameOrder& order) const;
  void settle(const VulkanStep& volume, Finder fastest);
  std::uint64_t reclaim(std::uint64_t bytes);
  void forgetVolume(std::uint64_t volume);

  Device& device_;
  bool probe_software_;
  PartMaker parts_;  // outlives what is in the making
  FrameTools tools_;
  FinderChoices finders_;
  LevelRoom room_;
  std::uint64_t record_room_;
};

}  // namespace blockwalk
