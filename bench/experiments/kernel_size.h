// SPDX-License-Identifier: Apache-2.0
// How much code a kernel is.
#pragma once

#include <cstddef>

#include "renderer/plan/kernel_key.h"

namespace blockwalk::bench {

// SPIR-V instructions in the functions of the render kernel for `key`, or of its general one, after its constants are
// set and SPIRV-Tools' passes for speed have removed what cannot run.
std::size_t kernelInstructions(const KernelKey& key, bool general);

}  // namespace blockwalk::bench
