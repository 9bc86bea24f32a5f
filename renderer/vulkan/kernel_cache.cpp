// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan/kernel_cache.h"

#include <cstdlib>
#include <string_view>

namespace blockwalk {

bool keepsKernels() {
  const char* value = std::getenv(kNoKernelCache);
  const std::string_view off = value != nullptr ? value : "";
  return off != "1" && off != "true" && off != "yes" && off != "y";
}

}  // namespace blockwalk
