// SPDX-License-Identifier: Apache-2.0
// Orders become frames under way: each is planned, after the finder was chosen where that is left to us, and drawn
// piece by piece (renderer/planned_frame.h).
#pragma once

#include <map>

#include "renderer/finder_choice.h"
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
  std::unique_ptr<FrameInProgress> begin(const VulkanVolume& volume, FrameOrder order);

  const Residency& residency() const { return tools_.residency; }
  void forget(std::uint64_t owner) { tools_.kept_sums.forget(owner); }

 private:
  class OrderedFrame;
  DeviceTraits traits(std::uint64_t volume) const;
  bool shouldProbe(const FrameOrder& order) const;
  void settle(std::uint64_t volume, Finder fastest);
  bool pageInstead(const VolumeInfo& info, const Plan& plan);
  bool coarsen(const VulkanVolume& volume, const Plan& plan);
  std::uint64_t reclaim(std::uint64_t bytes);
  void forgetVolume(std::uint64_t volume);

  Device& device_;
  bool probe_software_;
  PartMaker parts_;  // outlives what is in the making
  FrameTools tools_;
  FinderChoices finders_;
  std::uint64_t page_above_bytes_;              // voxels of a level that take more come and go; 0: never
  std::map<std::uint64_t, int> finest_levels_;  // of volumes, that `auto` takes, where it is not 0
};

}  // namespace blockwalk
