// SPDX-License-Identifier: Apache-2.0
// What this process may still take of the host's memory: a software device's memory is the same.
#pragma once

#include <cstdint>

namespace blockwalk {

// The least of: what the host has available, what is left of the address space (RLIMIT_AS), what is left to the control
// group. Reads three small files; 0 where nothing is left.
std::uint64_t freeHostBytes();

}  // namespace blockwalk
