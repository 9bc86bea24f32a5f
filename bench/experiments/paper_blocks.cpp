// SPDX-License-Identifier: Apache-2.0
// Derin et al. 2021, Tables 1 to 3 and Fig. 5: what walking and culling are worth, counting blocks and blending.
#include <fmt/format.h>

#include "bench/experiments/experiments.h"
#include "bench/experiments/paper_runs.h"
#include "bench/experiments/record.h"
#include "bench/experiments/scene_files.h"

namespace blockwalk::bench {
namespace {

using nlohmann::json;

// The procedural volumes have the proportions of the paper's Table 3; thresholds are those of its Fig. 5.
struct PaperScene {
  std::string name;
  std::string volume;
  double threshold = 0;  // densities from here are in the range; 0: all
  bool from_behind = false;
};

const PaperScene kPaperScenes[] = {{"fish a", "fossil", 4}, {"fish b", "fossil", 104},   {"fish c", "fossil", 196},
                                   {"chip d", "chip"},      {"rock e", "rock", 0, true}, {"rock f", "rock", 5},
                                   {"rock g", "rock", 121}, {"rock h", "rock", 153}};

std::vector<Choice> choices(bool ray_query) {
  std::vector<Choice> result;
  for (Finder finder : {Finder::query, Finder::grid}) {
    if (finder == Finder::query && !ray_query) continue;
    const std::string name = finder == Finder::query ? "query" : "grid";
    result.push_back({.name = name, .finder = finder, .walk = false, .cull = false});
    result.push_back({.name = name + "+cull", .finder = finder, .walk = false});
    result.push_back({.name = name + "+walk", .finder = finder, .cull = false});
    result.push_back({.name = name + "+walk+cull", .finder = finder});
  }
  return result;
}

View blocksView(const PaperScene& scene, const ExperimentOptions& options, const VolumeInfo& info) {
  View view = spellOut(resolveView(pictureOf(options), info));
  if (scene.threshold > 0) {
    const double most = info.channels[0].dataFromStored(info.channels[0].density_max);
    view.channels[0].range = DensityRange{.lo = scene.threshold, .hi = most};
  }
  // Rock e is the only one seen from elsewhere.
  if (scene.from_behind) view.eye = *view.target + glm::dvec3(-1, 0.3, 0.4) * glm::length(*view.eye - *view.target);
  return view;
}

}  // namespace

json runPaperBlocks(const ExperimentOptions& options) {
  const auto renderer = createRenderer(options.device);
  json result = newRecord("paper-blocks", *renderer, options);
  result["demo_side"] = options.demo_side;
  result["scenes"] = json::array();
  const SceneFiles files(options, {"fossil", "chip", "rock"});
  std::vector<PaperScene> scenes(std::begin(kPaperScenes), std::end(kPaperScenes));
  for (const SceneFile& file : files.all()) {
    if (!file.procedural) scenes.push_back({.name = file.name, .volume = file.name});
  }
  const std::vector<Choice> all = choices(renderer->device().ray_query);
  for (const PaperScene& scene : scenes) {
    const auto volume = renderer->load(VolumeFile(files.named(scene.volume)));
    View view = blocksView(scene, options, volume->info());
    json entry{{"name", scene.name}, {"dims", dimsJson(volume->info())}, {"threshold", scene.threshold}};
    for (Mode mode : {Mode::blocks, Mode::blend}) {
      view.mode = mode;
      const std::string name = mode == Mode::blocks ? "blocks" : "blend";
      if (options.on_step) options.on_step(scene.name + ", " + name);
      entry[name] = timeChoices(*renderer, *volume, view, all, options.samples);
    }
    entry["bytes"] = residentBytes(*volume);
    writePicture(options, scene.name, renderer->render(*volume, view, {}));
    for (Output output : {Output::cost, Output::queries}) {
      view.output = output;
      for (const Choice& choice : options.pictures.empty() ? std::vector<Choice>{} : all) {
        const std::string what = output == Output::cost ? " cost " : " queries ";
        writePicture(options, scene.name + what + choice.name, renderer->render(*volume, with(view, choice), {}));
      }
    }
    result["scenes"].push_back(std::move(entry));
  }
  return result;
}

}  // namespace blockwalk::bench
