// SPDX-License-Identifier: Apache-2.0
// bench NAME [--json FILE] [FILE.bwv...]: runs a named experiment and writes what it measured as JSON, to standard
// output where no file is named; bench/tables.py and bench/plot.py show it. What comes next, and what came of it where
// that is a line, goes to standard error.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "bench/experiments/experiments.h"
#include "protocol/view_fields.h"
#include "renderer/driver.h"
#include "volume/error.h"

namespace {

using namespace blockwalk;

constexpr int kWorkFailed = 1;
constexpr int kWrongUsage = 2;

struct Command {
  std::string json_path;
  bench::ExperimentOptions options;
  std::vector<std::pair<std::string, CLI::Option*>> view_flags;  // of the experiment that was named

  // The view and format that the flags ask for; what none names is the experiment's own choice.
  ImageRequest request(const std::vector<std::pair<std::string, std::string>>& defaults) const {
    ImageRequest result;
    for (const auto& [name, text] : defaults) setViewField(result, name, text);
    std::vector<std::pair<std::string, std::string>> given;
    for (const auto& [name, flag] : view_flags) {
      for (const std::string& text : flag->results()) given.emplace_back(name, text);
    }
    setViewFields(result, given);
    return result;
  }
};

struct Experiment {
  const char* name;
  const char* help;
  nlohmann::json (*run)(const Command&);
  bool draws_view = false;  // the given volumes alone, in the view that the flags say
};

template <nlohmann::json (*run)(const bench::ExperimentOptions&)>
nlohmann::json runOptions(const Command& command) {
  return run(command.options);
}

nlohmann::json runFrames(const Command& command) {
  return bench::runFrameExperiment(command.options, command.request({{"size", "512x512"}}));
}

nlohmann::json runRefine(const Command& command) {
  return bench::runRefineExperiment(command.options, command.request({{"size", "512x512"}, {"samples", "16"}}));
}

constexpr Experiment kExperiments[] = {
    {"error", "error against run time for every knob", runOptions<bench::runErrorExperiment>},
    {"frames", "frame time of every finder, walk and cull on the volumes named", runFrames, true},
    {"kernels", "specialised kernels against a general one", runOptions<bench::runKernelExperiment>},
    {"masks", "what range masks cull", runOptions<bench::runMaskExperiment>},
    {"paper-blocks", "walking and culling, after Derin et al. 2021", runOptions<bench::runPaperBlocks>},
    {"paper-boundary", "finders of the active region, after Wald et al. 2021", runOptions<bench::runPaperBoundary>},
    {"paper-octree", "an octree from near and far, after Lukic 2017", runOptions<bench::runPaperOctree>},
    {"refine", "a picture's samples in steps against all at once, on the volumes named", runRefine, true}};

void setSize(bench::ExperimentOptions& options, const std::string& text) {
  ImageRequest request;
  setViewField(request, "size", text);
  options.width = request.view.width;
  options.height = request.view.height;
}

void write(const nlohmann::json& result, const std::string& path) {
  const std::string text = result.dump(1) + "\n";
  if (path.empty()) {
    fmt::print("{}", text);
    return;
  }
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw DataError(fmt::format("{}: cannot be written", path));
}

// What cannot be written is said before hours of measuring.
void run(const Experiment& experiment, Command& command) {
  if (!command.json_path.empty() && !std::ofstream(command.json_path, std::ios::app)) {
    throw DataError(fmt::format("{}: cannot be written", command.json_path));
  }
  if (!command.options.pictures.empty()) {
    std::error_code error;
    std::filesystem::create_directories(command.options.pictures, error);
    if (error) throw DataError(fmt::format("--pictures {}: {}", command.options.pictures.string(), error.message()));
  }
  command.options.on_step = [](const std::string& line) { fmt::print(stderr, "{}\n", line); };
  const std::string set_up = setUpDriver().note;
  command.options.on_step(set_up);
  nlohmann::json result = experiment.run(command);
  result["set_up"] = set_up;
  write(result, command.json_path);
}

void addViewFlags(CLI::App& app, Command& command, const Experiment& experiment) {
  std::vector<std::pair<std::string, CLI::Option*>> flags;
  for (const ViewField& field : viewFields()) {
    CLI::Option* flag = app.add_option("--" + std::string(field.name))->group("View");
    flag->description(std::string(field.help))->type_name(std::string(field.value));
    flags.emplace_back(field.name, flag);
  }
  app.callback([&command, &experiment, flags] {
    command.view_flags = flags;
    run(experiment, command);
  });
}

void addSceneFlags(CLI::App& app, Command& command, const Experiment& experiment) {
  app.add_option_function<std::string>(
      "--size", [&command](const std::string& text) { setSize(command.options, text); },
      "pixels of a picture, WxH (160x120)");
  app.add_option("--demo-side", command.options.demo_side, "voxels of the procedural volumes (96)")
      ->check(CLI::Range(8, 4096));
  app.add_option_function<std::uint64_t>(
         "--page-mib", [&command](std::uint64_t mib) { command.options.device.page_bytes = mib << 20; },
         "room for the voxels of a level, which beyond it come and go block by block")
      ->check(CLI::Range(0, 1 << 20));
  app.add_option("--pictures", command.options.pictures, "paper-...: a folder for pictures of what is measured");
  app.callback([&command, &experiment] { run(experiment, command); });
}

void addExperiment(CLI::App& app, Command& command, const Experiment& experiment) {
  CLI::App* named = app.add_subcommand(experiment.name, experiment.help);
  CLI::Option* files =
      named->add_option("FILE", command.options.files,
                        experiment.draws_view ? "volumes to measure" : "volumes to measure beside the procedural ones");
  files->check(CLI::ExistingFile)->required(experiment.draws_view);
  named->add_option("--json", command.json_path, "write there instead of to standard output");
  // `samples` is a member of the view too.
  named
      ->add_option(experiment.draws_view ? "--repeat" : "--samples", command.options.samples,
                   "frames a figure, whose time is their median (5)")
      ->check(CLI::Range(1, 1000));
  named->add_option("--device", command.options.device.device, "part of a device's name, or its number");
  experiment.draws_view ? addViewFlags(*named, command, experiment) : addSceneFlags(*named, command, experiment);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Named experiments: programs that measure.", "bench"};
  app.set_version_flag("--version", BLOCKWALK_VERSION);
  app.require_subcommand(1);
  app.footer("Exit codes: 0 done, 1 the work failed, 2 wrong usage.");
  Command command;
  for (const Experiment& experiment : kExperiments) addExperiment(app, command, experiment);
  try {
    app.parse(argc, argv);
    return 0;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help
    fmt::print(stderr, "bench: {}; see bench --help\n", error.what());
    return kWrongUsage;
  } catch (const ViewError& error) {
    fmt::print(stderr, "bench: {}\n", error.what());
    return kWrongUsage;
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench: {}\n", error.what());
    return kWorkFailed;
  }
}
