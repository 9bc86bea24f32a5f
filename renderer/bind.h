// SPDX-License-Identifier: Apache-2.0
// Everything that the kernel reads of a frame, once its parts are resident.
#pragma once

#include <cstdint>
#include <vector>
#include <vulkan/vulkan_raii.hpp>

#include "renderer/plan/plan.h"
#include "renderer/resident/pins.h"
#include "shaders/kernel_interface.h"
#include "view/frame.h"

namespace blockwalk {

class PagedVoxels;

// Voxels that come and go, of a channel of a level; their blocks' bits in FrameParams::wanted begin at the word.
struct PagedPart {
  PagedVoxels* voxels = nullptr;
  std::uint32_t first_word = 0;
};

struct BoundFrame {
  gpu::FrameData data{};                                  // but for the frame's own buffers
  std::vector<vk::AccelerationStructureKHR> instances{};  // of each level, that the plan's kernel queries, if it does
  FinderBuild build{};                                    // of the finest level's active region, if there is one
  std::vector<PagedPart> paged{};
  std::uint32_t wanted_words = 0;  // of all of them
};

// `pins` hold all that the plan needs. They keep it for as long as it is drawn.
BoundFrame bind(const ResolvedView& view, const VolumeInfo& info, const Plan& plan, const Pins& pins);

}  // namespace blockwalk
