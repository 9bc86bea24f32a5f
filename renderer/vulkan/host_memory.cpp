// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan/host_memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>

namespace blockwalk {
namespace {

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

// The number after `format`'s words in the first line that has them; nothing where the file or the line is not there.
// Without streams: this is called where memory is short.
std::optional<std::uint64_t> numberIn(const char* path, const char* format) {
  const File file(std::fopen(path, "re"), [](std::FILE* f) { return std::fclose(f); });
  if (!file) return std::nullopt;
  char line[256];
  while (std::fgets(line, sizeof line, file.get()) != nullptr) {
    std::uint64_t value = 0;
    if (std::sscanf(line, format, &value) == 1) return value;
  }
  return std::nullopt;
}

std::uint64_t difference(std::uint64_t whole, std::uint64_t used) { return whole > used ? whole - used : 0; }

}  // namespace

std::uint64_t freeHostBytes() {
  std::uint64_t free = std::numeric_limits<std::uint64_t>::max();
  if (const auto kib = numberIn("/proc/meminfo", "MemAvailable: %" SCNu64)) free = std::min(free, *kib << 10);
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY) {
    const auto pages = numberIn("/proc/self/statm", "%" SCNu64).value_or(0);
    const auto page_bytes = static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
    free = std::min(free, difference(limit.rlim_cur, pages * page_bytes));
  }
  const auto most = numberIn("/sys/fs/cgroup/memory.max", "%" SCNu64);  // "max" is no number
  const auto used = numberIn("/sys/fs/cgroup/memory.current", "%" SCNu64);
  if (most && used) free = std::min(free, difference(*most, *used));
  return free;
}

}  // namespace blockwalk
