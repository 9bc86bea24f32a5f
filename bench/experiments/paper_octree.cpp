// SPDX-License-Identifier: Apache-2.0
// Lukic 2017, IV: an octree's frame rate depends on how near the eye is, and on how much of it is semi-transparent.
#include <fmt/format.h>

#include "bench/experiments/experiments.h"
#include "bench/experiments/paper_runs.h"
#include "bench/experiments/record.h"
#include "bench/experiments/scene_files.h"

namespace blockwalk::bench {
namespace {

using nlohmann::json;

// Of the volume's diagonal, from its centre.
struct Distance {
  const char* name;
  double diagonals;
};
constexpr Distance kDistances[] = {{"near", 0.4}, {"medium", 1.5}, {"far", 6}};

// Extinctions of colour volumes, so that one voxel hides what is behind it, or hundreds do not.
struct Matter {
  const char* name;
  double extinction;
};
constexpr Matter kMatters[] = {{"opaque", 100}, {"semi-transparent", 0.02}};

const Choice kChoices[] = {{.name = "none", .finder = Finder::none},
                           {.name = "octree", .finder = Finder::octree, .walk = false},
                           {.name = "octree+walk", .finder = Finder::octree},
                           {.name = "grid+walk", .finder = Finder::grid},
                           {.name = "auto", .finder = Finder::automatic}};

// Voxels beyond the room for them: blocks read for a view's first picture and for the one after it, and the time of
// both from order to picture.
json pagesJson(const Frame& first, const Frame& second) {
  const auto bothOf = [&](auto member) { return json::array({first.stats.*member, second.stats.*member}); };
  return {{"read", bothOf(&RenderStats::pages_read)},
          {"total_ms", bothOf(&RenderStats::total_ms)},
          {"complete", first.stats.isComplete() && second.stats.isComplete()}};
}

}  // namespace

json runPaperOctree(const ExperimentOptions& options) {
  const auto renderer = createRenderer(options.device);
  json result = newRecord("paper-octree", *renderer, options);
  result["demo_side"] = options.demo_side;
  if (options.device.page_bytes) result["page_bytes"] = *options.device.page_bytes;
  result["scenes"] = json::array();
  const SceneFiles files(options, {"fossil", "rock"});
  for (const SceneFile& file : files.all()) {
    const auto volume = renderer->load(VolumeFile(file.path));
    const VolumeInfo& info = volume->info();
    const WorldBox box = worldBox(info);
    const double diagonal = glm::length(box.max - box.min);
    for (const Matter& matter : kMatters) {
      if (info.type != VoxelType::rgba8 && matter.name != kMatters[0].name) continue;
      for (const Distance& distance : kDistances) {
        for (int level : {kAutoLevel, 0}) {
          View view = pictureOf(options);
          view.extinction = matter.extinction;
          view.level = level;
          view = spellOut(resolveView(view, info));
          view.eye = *view.target + glm::normalize(*view.eye - *view.target) * (distance.diagonals * diagonal);
          const std::string name =
              fmt::format("{}, {}, {}, level {}", file.name, matter.name, distance.name, level == 0 ? "0" : "auto");
          if (options.on_step) options.on_step(name);
          const Frame frame = renderer->render(*volume, view, {});
          json scene = {{"name", file.name},
                        {"matter", info.type == VoxelType::rgba8 ? matter.name : "own transfer function"},
                        {"distance", distance.name},
                        {"level", level == 0 ? json(0) : json("auto")},
                        {"drawn_level", frame.stats.level}};
          if (frame.stats.paged) scene["pages"] = pagesJson(frame, renderer->render(*volume, view, {}));
          scene["runs"] = timeChoices(*renderer, *volume, view, kChoices, options.samples);
          result["scenes"].push_back(std::move(scene));
          writePicture(options, name, frame);
        }
      }
    }
    result["bytes"][file.name] = residentBytes(*volume);
  }
  return result;
}

}  // namespace blockwalk::bench
