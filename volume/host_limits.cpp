// SPDX-License-Identifier: Apache-2.0
#include "volume/host_limits.h"

#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <string_view>

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

using Path = std::array<char, 512>;

// False where it does not fit.
template <typename... Parts>
bool join(Path& path, const char* format, Parts... parts) {
  const int length = std::snprintf(path.data(), path.size(), format, parts...);
  return length >= 0 && static_cast<std::size_t>(length) < path.size();
}

// Of one group; nothing where it has no limit.
std::optional<std::uint64_t> leftTo(const char* cgroups, const char* group) {
  Path path;
  const auto number = [&](const char* file, const char* format) {
    return join(path, "%s%s/%s", cgroups, group, file) ? numberIn(path.data(), format) : std::nullopt;
  };
  const auto most = number("memory.max", "%" SCNu64);  // "max" is no number
  const auto used = number("memory.current", "%" SCNu64);
  if (!most || !used) return std::nullopt;
  const std::uint64_t cached = number("memory.stat", "inactive_file %" SCNu64).value_or(0);
  return difference(*most, difference(*used, cached));
}

// The process's group, "/a/b"; in a namespace of its own, "/".
bool readGroup(const char* proc, Path& group) {
  Path path;
  if (!join(path, "%s/self/cgroup", proc)) return false;
  const File file(std::fopen(path.data(), "re"), [](std::FILE* f) { return std::fclose(f); });
  while (file && std::fgets(group.data(), static_cast<int>(group.size()), file.get()) != nullptr) {
    constexpr std::string_view kUnified = "0::";  // the line of version 2
    if (std::strncmp(group.data(), kUnified.data(), kUnified.size()) != 0) continue;
    std::memmove(group.data(), group.data() + kUnified.size(), group.size() - kUnified.size());
    group[std::strcspn(group.data(), "\n")] = '\0';
    return group[0] == '/';
  }
  return false;
}

// The process's group and each above it, up to the root, or the root alone where it has none.
template <typename Visit>
void forEachGroup(const char* proc, Visit visit) {
  Path group;
  if (!readGroup(proc, group)) group[0] = '\0';
  for (;;) {
    visit(group.data());
    char* const last = std::strrchr(group.data(), '/');
    if (last == nullptr) return;
    *last = '\0';
  }
}

// Of one group, rounded up; nothing where it has no limit.
std::optional<int> processorsOf(const char* cgroups, const char* group) {
  Path path;
  if (!join(path, "%s%s/cpu.max", cgroups, group)) return std::nullopt;
  const File file(std::fopen(path.data(), "re"), [](std::FILE* f) { return std::fclose(f); });
  std::uint64_t quota = 0;
  std::uint64_t period = 0;
  // "max 100000" where there is none.
  if (!file || std::fscanf(file.get(), "%" SCNu64 " %" SCNu64, &quota, &period) != 2 || period == 0)
    return std::nullopt;
  constexpr std::uint64_t kMost = 1 << 20;
  return static_cast<int>(std::clamp<std::uint64_t>(quota / period + (quota % period != 0 ? 1 : 0), 1, kMost));
}

}  // namespace

std::uint64_t freeHostBytes(const char* proc, const char* cgroups) {
  std::uint64_t free = std::numeric_limits<std::uint64_t>::max();
  Path path;
  if (join(path, "%s/meminfo", proc)) {
    if (const auto kib = numberIn(path.data(), "MemAvailable: %" SCNu64)) free = std::min(free, *kib << 10);
  }
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY) {
    const auto pages = numberIn("/proc/self/statm", "%" SCNu64).value_or(0);
    const auto page_bytes = static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
    free = std::min(free, difference(limit.rlim_cur, pages * page_bytes));
  }
  forEachGroup(proc, [&](const char* group) {
    if (const auto left = leftTo(cgroups, group)) free = std::min(free, *left);
  });
  return free;
}

HostProcessors hostProcessors(const char* proc, const char* cgroups) {
  HostProcessors result;
  cpu_set_t set;
  // A host of more processors than the set holds is not limited here.
  const int allowed = sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : CPU_SETSIZE;
  result.to_run_on = result.to_use = std::max(allowed, 1);
  forEachGroup(proc, [&](const char* group) {
    if (const auto most = processorsOf(cgroups, group)) result.to_use = std::min(result.to_use, *most);
  });
  return result;
}

}  // namespace blockwalk
