// SPDX-License-Identifier: Apache-2.0
// A volume that frames can be ordered of. What is resident of it is in the renderer's one table.
#pragma once

#include <functional>
#include <list>
#include <memory>

#include "renderer/renderer.h"
#include "renderer/resident/residency.h"

namespace blockwalk {

// One step in time, as frames draw it.
class VulkanStep {
 public:
  using Forget = std::function<void(std::uint64_t serial)>;

  // `forget` is called when it ends, with its serial.
  VulkanStep(VolumeFile file, std::uint64_t family, Forget forget);  // family 0: its own
  ~VulkanStep();
  VulkanStep(const VulkanStep&) = delete;
  VulkanStep& operator=(const VulkanStep&) = delete;

  const StoredVolume& stored() const { return stored_; }
  std::uint64_t serial() const { return stored_.serial; }
  const VolumeInfo& info() const { return stored_.file->info(); }
  int number() const { return stored_.file->step(); }
  // Serial of the volume's first step: what is measured of one step holds for all.
  std::uint64_t family() const { return family_; }
  std::uint64_t hostBytes() const;  // about what the file keeps in memory to find its pages

 private:
  StoredVolume stored_;
  std::uint64_t family_;
  Forget forget_;
};

// Its steps are opened when a frame asks for them. So many stay open beside those that frames draw, in so many bytes;
// the one used longest ago goes first, with all that is resident of it.
class VulkanVolume final : public ResidentVolume {
 public:
  static constexpr std::size_t kMostSteps = 256;
  static constexpr std::uint64_t kMostStepBytes = std::uint64_t{256} << 20;

  // `residency` outlives it.
  VulkanVolume(VolumeFile file, Residency& residency, VulkanStep::Forget forget);

  // Throws ViewError for a step that cannot be opened: the others still can.
  std::shared_ptr<const VulkanStep> step(int number);
  const VolumeInfo& info() const override { return file_->info(); }
  std::uint64_t deviceBytes() const override;
  std::vector<ResidentPart> parts() const override;

 private:
  VolumeFile openStep(int number) const;

  Residency& residency_;
  VulkanStep::Forget forget_;
  std::uint64_t family_ = 0;
  std::list<std::shared_ptr<VulkanStep>> steps_;  // the one used last comes first
  std::shared_ptr<const VolumeFile> file_;        // of the first step
};

}  // namespace blockwalk
