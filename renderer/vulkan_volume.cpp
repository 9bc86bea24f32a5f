// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan_volume.h"

#include <atomic>

namespace blockwalk {
namespace {

std::uint64_t nextSerial() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

}  // namespace

VulkanVolume::VulkanVolume(VolumeFile file, Residency& residency, std::function<void(std::uint64_t)> forget)
    : stored_{.serial = nextSerial(), .file = std::make_shared<const VolumeFile>(std::move(file))},
      residency_(residency),
      forget_(std::move(forget)) {}

VulkanVolume::~VulkanVolume() { forget_(serial()); }

std::uint64_t VulkanVolume::deviceBytes() const {
  std::uint64_t bytes = 0;
  for (const ResidentPart& part : parts()) bytes += part.bytes;
  return bytes;
}

}  // namespace blockwalk
