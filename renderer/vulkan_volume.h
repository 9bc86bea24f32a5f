// SPDX-License-Identifier: Apache-2.0
// A volume that frames can be ordered of. What is resident of it is in the renderer's one table.
#pragma once

#include "renderer/renderer.h"
#include "renderer/resident/residency.h"

namespace blockwalk {

class VulkanVolume final : public ResidentVolume {
 public:
  // `forget` is called when it ends, with its serial. `residency` outlives it.
  VulkanVolume(VolumeFile file, Residency& residency, std::function<void(std::uint64_t)> forget);
  ~VulkanVolume() override;
  VulkanVolume(const VulkanVolume&) = delete;
  VulkanVolume& operator=(const VulkanVolume&) = delete;

  const StoredVolume& stored() const { return stored_; }
  std::uint64_t serial() const { return stored_.serial; }
  const VolumeInfo& info() const override { return stored_.file->info(); }
  std::uint64_t deviceBytes() const override;
  std::vector<ResidentPart> parts() const override { return residency_.parts(serial()); }

 private:
  StoredVolume stored_;
  Residency& residency_;
  std::function<void(std::uint64_t)> forget_;
};

}  // namespace blockwalk
