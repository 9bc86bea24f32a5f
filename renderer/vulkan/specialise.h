// SPDX-License-Identifier: Apache-2.0
// A kernel's SPIR-V with its choices made: what a driver does with specialisation constants too, but only after it has
// read, inlined and optimised every path that no frame takes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "renderer/plan/plan.h"

namespace blockwalk {

// The module with the key's values in place of its specialisation constants, and without the paths and functions that
// they rule out. `module` is a whole valid one. Throws DeviceError where SPIRV-Tools refuses it.
std::vector<std::uint32_t> specialise(std::span<const std::uint32_t> module, const KernelKey& key);

}  // namespace blockwalk
