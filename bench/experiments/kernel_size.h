// SPDX-License-Identifier: Apache-2.0
// How much code a kernel is.
#pragma once

#include <cstddef>
#include <optional>

#include "renderer/plan/plan.h"

namespace blockwalk::bench {

// SPIR-V instructions in the functions of the render kernel for `key` after its constants are set and SPIRV-Tools'
// passes for speed have removed what cannot run; without a key those of the general kernel after the same passes.
std::size_t kernelInstructions(const std::optional<KernelKey>& key, bool ray_query);

}  // namespace blockwalk::bench
