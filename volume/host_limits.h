// SPDX-License-Identifier: Apache-2.0
// What this process may still take of the host: of memory, which a software device's is too, and of its processors. The
// folders are those of the kernel's own files.
#pragma once

#include <cstdint>

namespace blockwalk {

// The least of: what the host has available, what is left of the address space (RLIMIT_AS), what is left to the control
// group and to each above it (cgroup v2: memory.max less memory.current, which counts files that were read; those that
// are inactive give way and count as free). Reads a few small files; 0 where nothing is left.
std::uint64_t freeHostBytes(const char* proc = "/proc", const char* cgroups = "/sys/fs/cgroup");

// The processors that the process may run on (its affinity), and those that it may use at a time: no more than the
// control group and each above it have a share of (cgroup v2: quota by period of cpu.max, rounded up). At least 1.
struct HostProcessors {
  int to_run_on = 1;
  int to_use = 1;
};
HostProcessors hostProcessors(const char* proc = "/proc", const char* cgroups = "/sys/fs/cgroup");

}  // namespace blockwalk
