// SPDX-License-Identifier: Apache-2.0
// What this process may still take of the host's memory: a software device's memory is the same.
#pragma once

#include <cstdint>

namespace blockwalk {

// The least of: what the host has available, what is left of the address space (RLIMIT_AS), what is left to the control
// group and to each above it (cgroup v2: memory.max less memory.current, which counts files that were read; those that
// are inactive give way and count as free). Reads a few small files; 0 where nothing is left. The folders are those of
// the kernel's own files.
std::uint64_t freeHostBytes(const char* proc = "/proc", const char* cgroups = "/sys/fs/cgroup");

}  // namespace blockwalk
