// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "bench/experiments/experiments.h"
#include "clients/cli/commands.h"
#include "protocol/view_fields.h"
#include "volume/error.h"

namespace blockwalk {
namespace {

struct Experiment {
  std::string_view name;
  std::string_view help;
  nlohmann::json (*run)(const bench::ExperimentOptions&);
};

constexpr Experiment kExperiments[] = {
    {"error", "error against run time for every knob", bench::runErrorExperiment},
    {"kernels", "specialised kernels against a general one", bench::runKernelExperiment},
    {"masks", "what range masks cull", bench::runMaskExperiment},
    {"paper-blocks", "walking and culling, after Derin et al. 2021", bench::runPaperBlocks},
    {"paper-boundary", "finders of the active region, after Wald et al. 2021", bench::runPaperBoundary},
    {"paper-octree", "an octree from near and far, after Lukic 2017", bench::runPaperOctree}};

void setSize(bench::ExperimentOptions& options, const std::string& text) {
  ImageRequest request;
  setViewField(request, "size", text);
  options.width = request.view.width;
  options.height = request.view.height;
}

struct BenchCommand {
  std::string name;
  std::string json_path;
  bench::ExperimentOptions options;

  void run() {
    if (!json_path.empty() && !std::ofstream(json_path, std::ios::app)) {
      throw DataError(fmt::format("{}: cannot be written", json_path));
    }
    if (!options.pictures.empty()) {
      std::error_code error;
      std::filesystem::create_directories(options.pictures, error);
      if (error) throw DataError(fmt::format("--pictures {}: {}", options.pictures.string(), error.message()));
    }
    options.on_step = [](const std::string& line) { fmt::print(stderr, "{}\n", line); };
    for (const Experiment& experiment : kExperiments) {
      if (experiment.name == name) write(experiment.run(options));
    }
  }

  void write(const nlohmann::json& result) const {
    const std::string text = result.dump(1) + "\n";
    if (json_path.empty()) {
      fmt::print("{}", text);
      return;
    }
    std::ofstream file(json_path, std::ios::binary);
    file << text;
    file.close();
    if (!file) throw DataError(fmt::format("{}: cannot be written", json_path));
  }
};

}  // namespace

void addBenchCommand(CLI::App& app) {
  auto bench = std::make_shared<BenchCommand>();
  CLI::App* command =
      app.add_subcommand("bench", "Run a named experiment; bench/tables.py and bench/plot.py show what it writes");
  std::vector<std::string> names;
  std::string help;
  for (const Experiment& experiment : kExperiments) {
    names.emplace_back(experiment.name);
    help += fmt::format("{}{}: {}", help.empty() ? "" : "; ", experiment.name, experiment.help);
  }
  command->add_option("NAME", bench->name, help)->required()->check(CLI::IsMember(names));
  command->add_option("FILE", bench->options.files, "volumes to measure beside the procedural ones")
      ->check(CLI::ExistingFile);
  command->add_option("--json", bench->json_path, "write there instead of to standard output");
  command->add_option_function<std::string>(
      "--size", [bench](const std::string& text) { setSize(bench->options, text); },
      "pixels of a picture, WxH (160x120)");
  command->add_option("--samples", bench->options.samples, "frames a figure, whose time is their median (5)")
      ->check(CLI::Range(1, 1000));
  command->add_option("--demo-side", bench->options.demo_side, "voxels of the procedural volumes (96)")
      ->check(CLI::Range(8, 4096));
  command->add_option("--pictures", bench->options.pictures, "paper-...: a folder for pictures of what is measured");
  command->add_option("--device", bench->options.device.device, "part of a device's name, or its number");
  command->callback([bench] { bench->run(); });
}

}  // namespace blockwalk
