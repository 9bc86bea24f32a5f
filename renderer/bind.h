// SPDX-License-Identifier: Apache-2.0
// Everything that the kernel reads of a frame, once its parts are resident.
#pragma once

#include <vulkan/vulkan_raii.hpp>

#include "renderer/plan/plan.h"
#include "renderer/resident/pins.h"
#include "shaders/kernel_interface.h"
#include "view/frame.h"

namespace blockwalk {

struct BoundFrame {
  gpu::FrameParams params{};                 // but for the frame's own buffers
  vk::AccelerationStructureKHR instances{};  // that the plan's kernel queries, if it does
  FinderBuild build{};                       // of the active region, if there is one
};

// `pins` hold all that the plan needs. They keep it for as long as it is drawn.
BoundFrame bind(const ResolvedView& view, const VolumeInfo& info, const Plan& plan, const Pins& pins);

}  // namespace blockwalk
