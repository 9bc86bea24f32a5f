// SPDX-License-Identifier: Apache-2.0
// A kernel that makes what is resident: few and small, made when first asked for, with push constants alone.
#pragma once

#include <cstdint>
#include <span>

#include "renderer/vulkan/device.h"

namespace blockwalk {

vk::raii::PipelineLayout makePushLayout(const Device& device, std::uint32_t push_bytes);

// `constants` are those of ids 0, 1, 2, ...
vk::raii::Pipeline makeSideKernel(const Device& device, std::span<const std::uint32_t> spirv,
                                  std::span<const std::uint32_t> constants, const vk::raii::PipelineLayout& layout);

}  // namespace blockwalk
