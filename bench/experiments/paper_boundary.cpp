// SPDX-License-Identifier: Apache-2.0
// Wald et al. 2021, Tables 1 to 4: what finding the active region costs, and what it saves.
#include <fmt/format.h>

#include <algorithm>

#include "bench/experiments/experiments.h"
#include "bench/experiments/paper_runs.h"
#include "bench/experiments/record.h"
#include "bench/experiments/scene_files.h"

namespace blockwalk::bench {
namespace {

using nlohmann::json;

constexpr int kMacrocellSides[] = {8, 16, 32};
constexpr int kDefaultSide = 16;  // the paper's

std::vector<Choice> builders(std::span<const int> sides) {
  std::vector<Choice> result;
  for (Finder finder : {Finder::clusters, Finder::boundary}) {
    for (int side : sides) {
      const std::string name = finder == Finder::clusters ? "clusters" : "boundary";
      result.push_back({.name = fmt::format("{} {}", name, side), .finder = finder, .macrocell = side});
    }
  }
  return result;
}

std::vector<Choice> finders(bool ray_query, std::span<const int> sides) {
  std::vector<Choice> result{{.name = "none", .finder = Finder::none}};
  if (ray_query) {
    for (Choice& choice : builders(sides)) result.push_back(std::move(choice));
    result.push_back({.name = "query+walk+cull", .finder = Finder::query});
  }
  result.push_back({.name = "grid+walk+cull", .finder = Finder::grid});
  result.push_back({.name = "octree+walk+cull", .finder = Finder::octree});
  result.push_back({.name = "auto", .finder = Finder::automatic});
  return result;
}

// As the paper's renderer at its best: trilinear, steps of half a voxel, gradient shading, early termination.
View boundaryView(const ExperimentOptions& options, const VolumeInfo& info) {
  View view = pictureOf(options);
  view.filter = Filter::linear;
  view.lit = true;
  return spellOut(resolveView(view, info));
}

// The left half drawn without skipping, the right half with: pictures of colour show no seam, those of cost do.
Frame halves(Renderer& renderer, ResidentVolume& volume, const View& view) {
  const Frame left = renderer.render(volume, with(view, {.name = "none", .finder = Finder::none}), {});
  Frame both = renderer.render(
      volume, with(view, {.name = "boundary", .finder = Finder::boundary, .macrocell = kDefaultSide}), {});
  for (std::size_t i = 0; i < static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height); ++i) {
    if (static_cast<int>(i % static_cast<std::size_t>(view.width)) >= view.width / 2) continue;
    if (isPicture(view.output)) {
      both.pixels[i] = left.pixels[i];
    } else {
      both.values[i] = left.values[i];
    }
  }
  return both;
}

}  // namespace

json runPaperBoundary(const ExperimentOptions& options) {
  const auto renderer = createRenderer(options.device);
  const bool ray_query = renderer->device().ray_query;
  json result = newRecord("paper-boundary", *renderer, options);
  result["demo_side"] = options.demo_side;
  result["scenes"] = json::array();
  const SceneFiles files(options, {"smoke", "vessels", "cells"});
  for (const SceneFile& file : files.all()) {
    const auto say = [&](const std::string& what) {
      if (options.on_step) options.on_step(file.name + ": " + what);
    };
    const auto volume = renderer->load(VolumeFile(file.path));
    std::vector<int> sides(std::begin(kMacrocellSides), std::end(kMacrocellSides));
    std::erase_if(sides,
                  [&](int side) { return side < volume->info().subblock_side; });  // macrocells are subblocks at least
    View view = boundaryView(options, volume->info());
    json entry{{"name", file.name}, {"type", voxelTypeName(volume->info().type)}, {"dims", dimsJson(volume->info())}};
    say("one ray a pixel");
    const std::vector<Choice> all = finders(ray_query, sides);
    entry["one_ray"] = timeChoices(*renderer, *volume, view, all, options.samples);
    say("four rays a pixel");
    view.samples = 4;
    entry["four_rays"] = timeChoices(*renderer, *volume, view, all, options.samples);
    view.samples = 1;
    if (ray_query) {
      say("rebuilding every frame");
      entry["rebuilt"] = timeChoices(*renderer, *volume, view, builders(sides), options.samples, true);
    }
    entry["bytes"] = residentBytes(*volume);
    if (!options.pictures.empty() && ray_query) {
      writePicture(options, file.name + " halves", halves(*renderer, *volume, view));
      view.output = Output::cost;
      writePicture(options, file.name + " cost halves", halves(*renderer, *volume, view));
      view.output = Output::mesh;
      for (const Choice& choice : builders(sides)) {
        writePicture(options, file.name + " mesh " + choice.name, renderer->render(*volume, with(view, choice), {}));
      }
    }
    result["scenes"].push_back(std::move(entry));
  }
  return result;
}

}  // namespace blockwalk::bench
