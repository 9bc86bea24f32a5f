// SPDX-License-Identifier: Apache-2.0
// What a renderer holds on its device, for reports. Plain data, no Vulkan.
#pragma once

#include <cstdint>
#include <string>

namespace blockwalk {

// A piece of a volume on the device.
struct ResidentPart {
  std::string what;  // voxels, blocks, masks, quarters, ... (renderer/plan/need.h)
  int level = 0;
  bool apron = false;  // of the level whose subblocks carry an apron (volume/file/apron.h)
  static constexpr int kAllChannels = -1;
  int channel = kAllChannels;  // of the volume
  std::uint64_t bytes = 0;
};

// What is resident of one kind, of all volumes.
struct PartTotal {
  std::string what;
  std::uint64_t count = 0;
  std::uint64_t bytes = 0;
  std::uint64_t made = 0;  // since the beginning: grows every frame where clients drive each other's parts out
};

}  // namespace blockwalk
