// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace blockwalk {

// Mesa's switch: "true" in the environment where it should keep no compiled kernels.
inline constexpr const char* kNoKernelCache = "MESA_SHADER_CACHE_DISABLE";

// Whether Mesa was left to keep them.
bool keepsKernels();

}  // namespace blockwalk
