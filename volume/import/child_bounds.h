// SPDX-License-Identifier: Apache-2.0
// Processes of their own for libraries that broken files can make loop, crash, or take all memory.
#pragma once

#include <sys/types.h>

#include <cstdint>

namespace blockwalk {

// Bytes of address space that this process has.
std::uint64_t usedAddressSpace();

// In the child, at once after fork(): it ends when `parent` does, has at most so much address space, leaves no core,
// says nothing, and dies of signals as usual.
void boundChild(pid_t parent, std::uint64_t most_bytes);

}  // namespace blockwalk
