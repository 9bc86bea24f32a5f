// SPDX-License-Identifier: Apache-2.0
#include "renderer/driver.h"

#include <fmt/format.h>
#include <malloc.h>
#include <pwd.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <string_view>

#include "renderer/vulkan/kernel_cache.h"
#include "renderer/vulkan/vector_width.h"
#include "volume/host_limits.h"

namespace blockwalk {
namespace {

constexpr const char* kWidth = "LP_NATIVE_VECTOR_WIDTH";
constexpr const char* kThreads = "LP_NUM_THREADS";
constexpr const char* kCacheFolder = "MESA_SHADER_CACHE_DIR";
constexpr const char* kCacheBytes = "MESA_SHADER_CACHE_MAX_SIZE";
constexpr const char* kMostCacheBytes = "128M";  // a kernel is some 30 KiB
constexpr int kWideBits = 512;

std::string_view environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

bool makeFolder(const std::filesystem::path& folder) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  return !failure && access(folder.c_str(), W_OK | X_OK) == 0;
}

}  // namespace

std::filesystem::path cacheFolder() {
  const std::filesystem::path named = environment("XDG_CACHE_HOME");
  if (named.is_absolute()) return named / "blockwalk";
  std::filesystem::path home = environment("HOME");
  if (!home.is_absolute()) {
    const passwd* user = getpwuid(getuid());
    home = user != nullptr && user->pw_dir != nullptr ? user->pw_dir : "";
  }
  return home.is_absolute() ? home / ".cache" / "blockwalk" : std::filesystem::path{};
}

DriverSetUp setUpDriver() {
  rlimit space{};
  if (getrlimit(RLIMIT_AS, &space) == 0 && space.rlim_cur != RLIM_INFINITY) mallopt(M_ARENA_MAX, 2);
  DriverSetUp result;
  std::filesystem::path folder = cacheFolder();
  if (!folder.empty() && !makeFolder(folder)) folder.clear();

  std::string width{environment(kWidth)};
  std::string why = "as the environment says";
  if (width.empty() && hasWideVectors()) {
    const double gain = folder.empty() ? measureWideVectors() : rememberedWideVectors(folder / "vector_width");
    why = fmt::format("512 bits are {:.2f} times as fast as 256", gain);
    if (gain >= kWorthwhileGain) {
      width = std::to_string(kWideBits);
      setenv(kWidth, width.c_str(), 1);
    }
  } else if (width.empty()) {
    why = "no AVX-512";
  }
  result.vector_bits = static_cast<int>(std::strtol(width.c_str(), nullptr, 10));
  result.note = fmt::format("vectors: {} ({})", width.empty() ? "the driver's own" : width + " bits", why);

  const HostProcessors processors = hostProcessors();
  if (!environment(kThreads).empty()) {
    result.note += fmt::format("; threads: {} (as the environment says)", environment(kThreads));
  } else if (processors.to_use < processors.to_run_on) {
    setenv(kThreads, std::to_string(processors.to_use).c_str(), 1);
    result.note += fmt::format("; threads: {} (of {} processors, as the control group has no more)", processors.to_use,
                               processors.to_run_on);
  }

  if (!keepsKernels()) {
    result.note += "; kernels are not kept: the environment says so";
    return result;
  }
  const std::filesystem::path root =
      environment(kCacheFolder).empty() ? (folder.empty() ? folder : folder / "kernels") : environment(kCacheFolder);
  const std::string leaf = fmt::format("vectors-{}", width.empty() ? "own" : width);
  const std::filesystem::path kept = root.filename() == leaf ? root : root / leaf;  // a child of this process has it
  if (root.empty() || !makeFolder(kept)) {
    setenv(kNoKernelCache, "true", 1);
    result.note += "; kernels are not kept: no folder to write to";
    return result;
  }
  setenv(kCacheFolder, kept.c_str(), 1);
  setenv(kCacheBytes, kMostCacheBytes, 0);
  result.kernel_cache = kept;
  result.note += fmt::format("; kernels are kept in {}", kept.string());
  return result;
}

}  // namespace blockwalk
