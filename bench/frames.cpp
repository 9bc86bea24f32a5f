// SPDX-License-Identifier: Apache-2.0
// Frame time of every finder, walk and cull on given volumes. Combinations alternate within one run, so that a noisy
// machine is equally noisy to all; medians are printed, and written as JSON with --json.
//
// Usage: bench_frames [--size WxH] [--samples N] [--json FILE] [--range LO:HI] [--level N] FILE.bwv...
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/render_json.h"
#include "protocol/view_fields.h"
#include "renderer/renderer.h"

namespace {

using namespace blockwalk;

struct Variant {
  std::string_view name;
  Finder finder;
  bool walk;
  bool cull;
};

constexpr Variant kVariants[] = {{"query", Finder::query, false, false},
                                 {"query+walk", Finder::query, true, false},
                                 {"query+walk+cull", Finder::query, true, true},
                                 {"grid", Finder::grid, false, false},
                                 {"grid+walk+cull", Finder::grid, true, true},
                                 {"clusters+walk+cull", Finder::clusters, true, true},
                                 {"boundary+walk+cull", Finder::boundary, true, true},
                                 {"octree", Finder::octree, false, true},
                                 {"octree+walk+cull", Finder::octree, true, true},
                                 {"none", Finder::none, false, false}};

bool asksRays(Finder finder) {
  return finder == Finder::query || finder == Finder::clusters || finder == Finder::boundary;
}

struct Options {
  ImageRequest request;
  int samples = 9;
  std::string json_path;
  std::vector<std::string> files;
};

Options parse(int argc, char** argv) {
  Options options;
  setViewField(options.request, "size", "512x512");
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (!argument.starts_with("--")) {
      options.files.emplace_back(argument);
      continue;
    }
    if (i + 1 == argc) throw std::invalid_argument(fmt::format("{} needs a value", argument));
    const std::string_view value = argv[++i];
    if (argument == "--samples") {
      options.samples = std::stoi(std::string(value));
      if (options.samples < 1) throw std::invalid_argument("--samples must be at least 1");
    } else if (argument == "--json") {
      options.json_path = value;
    } else {
      setViewField(options.request, argument.substr(2), value);
    }
  }
  return options;
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

nlohmann::json measure(Renderer& renderer, const std::string& path, const Options& options) {
  auto volume = renderer.load(VolumeFile(path));
  nlohmann::json result{{"file", path}};
  std::vector<std::vector<double>> times(std::size(kVariants));
  for (int sample = -1; sample < options.samples; ++sample) {  // the first round warms up
    for (std::size_t i = 0; i < std::size(kVariants); ++i) {
      if (asksRays(kVariants[i].finder) && !renderer.device().ray_query) continue;
      View view = options.request.view;
      view.finder = kVariants[i].finder;
      view.walk = kVariants[i].walk;
      view.cull = kVariants[i].cull;
      const Frame frame = renderer.render(*volume, view, {.count = sample < 0});
      if (sample >= 0) {
        times[i].push_back(frame.stats.gpu_ms);
        continue;
      }
      nlohmann::json& entry = result["variants"][std::string(kVariants[i].name)];
      entry = {{"queries", frame.stats.queries},
               {"block_visits", frame.stats.block_visits},
               {"subblock_visits", frame.stats.subblock_visits},
               {"voxel_steps", frame.stats.voxel_steps},
               {"kernel", frame.stats.kernel},
               {"level", frame.stats.level}};
      if (frame.stats.finder_build.rebuilt) entry["build"] = statsJson(frame.stats)["finder_build"];
    }
  }
  result["resident_bytes"] = volume->deviceBytes();
  fmt::print("{}, {} bytes resident\n", path, volume->deviceBytes());
  for (std::size_t i = 0; i < std::size(kVariants); ++i) {
    if (times[i].empty()) continue;
    nlohmann::json& entry = result["variants"][std::string(kVariants[i].name)];
    entry["median_ms"] = median(times[i]);
    entry["min_ms"] = *std::ranges::min_element(times[i]);
    fmt::print("  {:16} {:9.2f} ms  queries {:>10}  blocks {:>10}  subblocks {:>11}  voxels {:>12}\n",
               kVariants[i].name, median(times[i]), entry["queries"].get<std::uint64_t>(),
               entry["block_visits"].get<std::uint64_t>(), entry["subblock_visits"].get<std::uint64_t>(),
               entry["voxel_steps"].get<std::uint64_t>());
  }
  return result;
}

}  // namespace

int main(int argc, char** argv) try {
  const Options options = parse(argc, argv);
  const auto renderer = createRenderer({});
  nlohmann::json report{{"device", renderer->device().name}, {"driver", renderer->device().driver_version}};
  fmt::print("{} ({}), {}x{}, {} samples\n", renderer->device().name, renderer->device().driver_version,
             options.request.view.width, options.request.view.height, options.samples);
  for (const std::string& file : options.files) report["volumes"].push_back(measure(*renderer, file, options));
  if (!options.json_path.empty()) std::ofstream(options.json_path) << report.dump(2) << '\n';
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "bench_frames: {}\n", error.what());
  return 1;
}
