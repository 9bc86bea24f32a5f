// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <memory>
#include <optional>

#include "clients/cli/build_flags.h"
#include "clients/cli/commands.h"
#include "clients/cli/progress.h"
#include "volume/demo/demo.h"
#include "volume/volume.h"

namespace blockwalk {
namespace {

struct DemoCommand {
  std::string name;
  int size = 512;
  std::string type;
  BuildFlags build;

  void run() const {
    const auto begun = std::chrono::steady_clock::now();
    std::optional<VoxelType> voxel_type;
    if (!type.empty()) voxel_type = type == "u16" ? VoxelType::u16 : VoxelType::f32;
    const auto source = openDemo(name, size, voxel_type);
    BuildOptions options = build.options(build.memoryBytes(), source->info().dims);
    BuildReport report;
    {
      Progress progress;
      options.progress = [&](std::string_view step, std::uint64_t done, std::uint64_t total) {
        progress.show(step, done, total);
      };
      report = buildVolume(*source, build.output, options);
    }
    printBuildReport(report, build.output,
                     std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count());
  }
};

}  // namespace

void addDemoCommand(CLI::App& app) {
  auto demo = std::make_shared<DemoCommand>();
  CLI::App* command = app.add_subcommand("demo", "Make a procedural volume");
  const auto names = demoNames();
  command
      ->add_option("NAME", demo->name,
                   "fossil, rock, chip (rgba8); vessels (u8); cells (u16); smoke (f32); tissue (3 x u16); cosmos (u16, "
                   "nearly all of it empty: any size)")
      ->required()
      ->check(CLI::IsMember(std::vector<std::string>(names.begin(), names.end())));
  command->add_option("--size", demo->size, "voxels along the longest axis (512)")->check(CLI::Range(1, kMaxDim));
  command->add_option("--type", demo->type, "cosmos: type of a voxel, u16 or f32 (u16)")
      ->check(CLI::IsMember({"u16", "f32"}));
  demo->build.add(*command);
  command->callback([demo] { demo->run(); });
}

}  // namespace blockwalk
