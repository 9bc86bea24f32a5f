// SPDX-License-Identifier: Apache-2.0
#include "renderer/vulkan/specialise.h"

#include <spirv-tools/optimizer.hpp>

#include <cstring>
#include <unordered_map>

#include "view/device_info.h"

namespace blockwalk {
namespace {

std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> constantsOf(const KernelKey& key) {
  std::uint32_t words[kKernelConstants];
  std::memcpy(words, &key, sizeof key);
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> values;
  for (std::uint32_t id = 0; id < kKernelConstants; ++id) values[id] = {words[id]};
  return values;
}

}  // namespace

std::vector<std::uint32_t> specialise(std::span<const std::uint32_t> module, const KernelKey& key) {
  spvtools::Optimizer optimizer(SPV_ENV_VULKAN_1_2);
  std::string complaint;
  optimizer.SetMessageConsumer(
      [&](spv_message_level_t, const char*, const spv_position_t&, const char* message) { complaint = message; });
  optimizer.RegisterPass(spvtools::CreateSetSpecConstantDefaultValuePass(constantsOf(key)))
      .RegisterPass(spvtools::CreateFreezeSpecConstantValuePass())
      .RegisterPass(spvtools::CreateFoldSpecConstantOpAndCompositePass())
      .RegisterPass(spvtools::CreateCCPPass())
      .RegisterPass(spvtools::CreateDeadBranchElimPass())
      .RegisterPass(spvtools::CreateEliminateDeadFunctionsPass());
  spvtools::OptimizerOptions options;
  options.set_run_validator(false);  // the build has validated the module
  std::vector<std::uint32_t> words;
  if (!optimizer.Run(module.data(), module.size(), &words, options)) {
    throw DeviceError("SPIRV-Tools cannot specialise the render kernel: " + complaint);
  }
  return words;
}

}  // namespace blockwalk
