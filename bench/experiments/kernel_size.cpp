// SPDX-License-Identifier: Apache-2.0
#include "bench/experiments/kernel_size.h"

#include <spirv-tools/optimizer.hpp>

#include <span>
#include <vector>

#include "render.spv.h"
#include "render_general.spv.h"
#include "render_general_rayquery.spv.h"
#include "render_rayquery.spv.h"
#include "renderer/vulkan/specialise.h"
#include "volume/error.h"

namespace blockwalk::bench {
namespace {

constexpr std::size_t kHeaderWords = 5;  // SPIR-V specification, 2.3: physical layout of a module
constexpr std::uint32_t kOpLine = 8;     // specification, 3.52: debug instructions are no code
constexpr std::uint32_t kOpFunction = 54;
constexpr std::uint32_t kOpNoLine = 317;

std::span<const std::uint32_t> moduleOf(bool general, bool ray_query) {
  if (general && ray_query) return render_general_rayquery_spirv;
  if (general) return render_general_spirv;
  if (ray_query) return render_rayquery_spirv;
  return render_spirv;
}

std::size_t countInstructions(std::span<const std::uint32_t> words) {
  std::size_t count = 0;
  bool in_function = false;
  for (std::size_t at = kHeaderWords; at < words.size(); at += words[at] >> 16) {
    const std::uint32_t opcode = words[at] & 0xffffu;
    in_function = in_function || opcode == kOpFunction;
    if (in_function && opcode != kOpLine && opcode != kOpNoLine) ++count;
  }
  return count;
}

}  // namespace

std::size_t kernelInstructions(const std::optional<KernelKey>& key, bool ray_query) {
  spvtools::Optimizer optimizer(SPV_ENV_VULKAN_1_2);
  std::string complaint;
  optimizer.SetMessageConsumer(
      [&](spv_message_level_t, const char*, const spv_position_t&, const char* message) { complaint = message; });
  optimizer.RegisterPerformancePasses();
  std::vector<std::uint32_t> special;
  if (key) special = specialise(moduleOf(false, ray_query), *key);
  const std::span<const std::uint32_t> module = key ? special : moduleOf(true, ray_query);
  std::vector<std::uint32_t> optimised;
  spvtools::OptimizerOptions options;
  options.set_run_validator(false);  // the build has validated the module
  if (!optimizer.Run(module.data(), module.size(), &optimised, options)) {
    throw DataError("SPIRV-Tools cannot optimise the render kernel: " + complaint);
  }
  return countInstructions(optimised);
}

}  // namespace blockwalk::bench
