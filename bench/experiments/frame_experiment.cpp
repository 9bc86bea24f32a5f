// SPDX-License-Identifier: Apache-2.0
// Frame time of every finder, walk and cull on given volumes. Combinations alternate within one run, so that a noisy
// machine is equally noisy to all; what is written are medians.
#include <fmt/format.h>

#include <algorithm>

#include "bench/experiments/experiments.h"
#include "bench/experiments/record.h"
#include "protocol/render_json.h"

namespace blockwalk::bench {
namespace {

using nlohmann::json;

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

json measureVariants(Renderer& renderer, const std::filesystem::path& path, const View& wanted,
                     const ExperimentOptions& options) {
  auto volume = renderer.load(VolumeFile(path));
  json result{{"file", path.string()}};
  std::vector<std::vector<double>> times(std::size(kVariants));
  for (int sample = -1; sample < options.samples; ++sample) {  // the first round warms up
    for (std::size_t i = 0; i < std::size(kVariants); ++i) {
      if (asksRays(kVariants[i].finder) && !renderer.device().ray_query) continue;
      View view = wanted;
      view.finder = kVariants[i].finder;
      view.walk = kVariants[i].walk;
      view.cull = kVariants[i].cull;
      // What counts is another kernel: neither is compiled within a time.
      if (sample < 0) renderer.render(*volume, view, {.count = false});
      const Frame frame = renderer.render(*volume, view, {.count = sample < 0});
      if (sample >= 0) {
        times[i].push_back(frame.stats.gpu_ms);
        continue;
      }
      json& entry = result["variants"][std::string(kVariants[i].name)];
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
  const auto say = [&](const std::string& line) {
    if (options.on_step) options.on_step(line);
  };
  say(fmt::format("{}, {} bytes resident", path.string(), volume->deviceBytes()));
  for (std::size_t i = 0; i < std::size(kVariants); ++i) {
    if (times[i].empty()) continue;
    json& entry = result["variants"][std::string(kVariants[i].name)];
    entry["median_ms"] = median(times[i]);
    entry["min_ms"] = *std::ranges::min_element(times[i]);
    say(fmt::format("  {:18} {:9.2f} ms  queries {:>10}  blocks {:>10}  subblocks {:>11}  voxels {:>12}",
                    kVariants[i].name, median(times[i]), entry["queries"].get<std::uint64_t>(),
                    entry["block_visits"].get<std::uint64_t>(), entry["subblock_visits"].get<std::uint64_t>(),
                    entry["voxel_steps"].get<std::uint64_t>()));
  }
  return result;
}

}  // namespace

json runFrameExperiment(const ExperimentOptions& options, const ImageRequest& request) {
  const auto renderer = createRenderer(options.device);
  json result = newRecord("frames", *renderer, options);
  result["size"] = {request.view.width, request.view.height};
  result["view"] = viewQuery(request);
  for (const auto& file : options.files) {
    result["volumes"].push_back(measureVariants(*renderer, file, request.view, options));
  }
  return result;
}

}  // namespace blockwalk::bench
