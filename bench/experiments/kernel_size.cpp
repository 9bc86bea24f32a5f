// SPDX-License-Identifier: Apache-2.0
#include "bench/experiments/kernel_size.h"

#include <spirv-tools/optimizer.hpp>

#include <span>
#include <vector>

#include "renderer/vulkan/kernel_layouts.h"
#include "volume/error.h"

namespace blockwalk::bench {
namespace {

constexpr std::size_t kHeaderWords = 5;  // SPIR-V specification, 2.3: physical layout of a module
constexpr std::uint32_t kOpLine = 8;     // specification, 3.52: debug instructions are no code
constexpr std::uint32_t kOpFunction = 54;
constexpr std::uint32_t kOpNoLine = 317;

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

std::size_t kernelInstructions(const KernelKey& key, bool general) {
  spvtools::Optimizer optimizer(SPV_ENV_VULKAN_1_2);
  std::string complaint;
  optimizer.SetMessageConsumer(
      [&](spv_message_level_t, const char*, const spv_position_t&, const char* message) { complaint = message; });
  optimizer.RegisterPerformancePasses();
  const std::vector<std::uint32_t> module = kernelWords(general ? generalKernel(key) : KernelName{.key = key});
  std::vector<std::uint32_t> optimised;
  spvtools::OptimizerOptions options;
  options.set_run_validator(false);  // the build has validated the module
  if (!optimizer.Run(module.data(), module.size(), &optimised, options)) {
    throw DataError("SPIRV-Tools cannot optimise the render kernel: " + complaint);
  }
  return countInstructions(optimised);
}

}  // namespace blockwalk::bench
