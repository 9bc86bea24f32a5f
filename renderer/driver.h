// SPDX-License-Identifier: Apache-2.0
// What a process asks of its Vulkan driver before there is one. Mesa takes this from the environment, which belongs to
// the whole process: whoever owns main() calls setUpDriver() first.
#pragma once

#include <filesystem>
#include <string>

namespace blockwalk {

struct DriverSetUp {
  int vector_bits = 0;  // that a software driver is asked for; 0: left to it
  std::filesystem::path
      kernel_cache;  // where Mesa keeps compiled kernels; empty: it keeps none, or was told where not to
  std::string note;  // one line that says so
};

// $XDG_CACHE_HOME/blockwalk, else ~/.cache/blockwalk; empty where neither can be.
std::filesystem::path cacheFolder();

// Sets, where the user has not:
// - LP_NATIVE_VECTOR_WIDTH to 512 where the processor has AVX-512 and is faster with it, which is measured once and
//   kept in the cache folder (renderer/vulkan/vector_width.h);
// - LP_NUM_THREADS to the processors that the control group may use, where those are fewer than the process may run on:
//   of more threads than that each waits for the others' quota;
// - MESA_SHADER_CACHE_MAX_SIZE, so that the cache stays small.
// And always MESA_SHADER_CACHE_DIR, to a folder for that width alone below the user's or else the cache folder: Mesa's
// cache knows the driver, LLVM and the processor by itself, but not the width, and would hand kernels of one width to a
// process of another. MESA_SHADER_CACHE_DISABLE stands.
// Where the address space is limited (RLIMIT_AS), malloc is held to two arenas: each takes 64 MiB of it, and every
// thread would have its own. To be called before the first renderer is made, and before there is a second thread.
DriverSetUp setUpDriver();

}  // namespace blockwalk
