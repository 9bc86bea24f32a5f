// SPDX-License-Identifier: Apache-2.0
// What leaving out is worth: the specialised kernel of each scene against one kernel that makes every choice at run
// time, and the bytes that the scene keeps on the device against those that it could.
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>

#include "bench/experiments/experiments.h"
#include "bench/experiments/kernel_size.h"
#include "bench/experiments/record.h"
#include "bench/experiments/scene_files.h"
#include "renderer/plan/plan.h"
#include "renderer/plan/transfer_table.h"
#include "shaders/kernel_interface.h"

namespace blockwalk::bench {
namespace {

using nlohmann::json;

void upperHalf(View& view, const VolumeInfo& info) {
  const ChannelInfo& channel = info.channels[0];
  const double lo = channel.dataFromStored(channel.density_min), hi = channel.dataFromStored(channel.density_max);
  view.channels[0].range = DensityRange{.lo = 0.5 * (lo + hi), .hi = hi};
}

void throughTheMiddle(View& view, const VolumeInfo& info) {
  const WorldBox box = worldBox(info);
  const glm::dvec3 normal(1, 1, 0);
  view.planes.push_back({.normal = normal, .offset = -glm::dot(normal, 0.5 * (box.min + box.max))});
}

using Look = std::function<void(View&, const VolumeInfo&)>;

Look withMode(Mode mode, Filter filter = Filter::nearest, bool lit = false) {
  return [=](View& view, const VolumeInfo&) {
    view.mode = mode;
    view.filter = filter;
    view.lit = lit;
  };
}

void preIntegrated(View& view, const VolumeInfo&) {
  view.filter = Filter::linear;
  view.classification = Classification::pre_integrated;
}

void depthOfHits(View& view, const VolumeInfo&) {
  view.mode = Mode::first_hit;
  view.output = Output::depth;
}

const Look kPlain = withMode(Mode::blend);
const Look kSmooth = withMode(Mode::blend, Filter::linear);

struct Scene {
  std::string name;
  std::string volume;
  Look look;  // changes of the default view
};

std::vector<Scene> namedScenes() {
  return {{"fossil, blend", "fossil", kPlain},
          {"fossil, upper half of the range", "fossil", upperHalf},
          {"fossil, first hit", "fossil", withMode(Mode::first_hit)},
          {"fossil, first hit, lit", "fossil", withMode(Mode::first_hit, Filter::nearest, true)},
          {"fossil, smooth", "fossil", kSmooth},
          {"fossil, clipped", "fossil", throughTheMiddle},
          {"rock, blocks", "rock", withMode(Mode::blocks)},
          {"chip, blend", "chip", kPlain},
          {"vessels, blend", "vessels", kPlain},
          {"vessels, largest value", "vessels", withMode(Mode::mip)},
          {"vessels, depth", "vessels", depthOfHits},
          {"cells, smooth and lit", "cells", withMode(Mode::blend, Filter::linear, true)},
          {"cells, surface", "cells", withMode(Mode::iso, Filter::linear, true)},
          {"smoke, blend", "smoke", kPlain},
          {"smoke, smooth", "smoke", kSmooth},
          {"smoke, pre-integrated", "smoke", preIntegrated},
          {"smoke, mean", "smoke", withMode(Mode::mean)}};
}

// Everything that the volume could ever need on the device, made resident.
void askForEverything(Renderer& renderer, ResidentVolume& volume) {
  const bool ray_query = renderer.device().ray_query;
  for (int level = 0; level < static_cast<int>(volume.info().levels.size()); ++level) {
    for (Filter filter : {Filter::nearest, Filter::linear}) {
      for (Finder finder : {Finder::grid, Finder::query}) {
        if (finder == Finder::query && !ray_query) continue;
        View view;
        view.width = view.height = 1;
        view.filter = filter;
        view.level = level;
        view.finder = finder;
        upperHalf(view, volume.info());
        renderer.render(volume, view, {.count = false});
      }
    }
  }
}

bool isNeeded(const ResidentPart& part, const Plan& plan) {
  if (part.level != plan.level || part.apron != plan.apron) return false;
  const auto isOf = [&](const ChannelPlan& drawn) { return part.channel == static_cast<int>(drawn.channel); };
  if (part.channel != ResidentPart::kAllChannels && std::ranges::none_of(plan.channels, isOf)) return false;
  if (part.what == "masks") return plan.asksFor(Part::masks);
  if (part.what == "quarters") return plan.asksFor(Part::visible_quarters);
  if (part.what == "grid") return plan.asksFor(Part::grid);
  if (part.what == "instances") return plan.asksFor(Part::instances);
  return true;
}

// The parts of a volume of which everything is resident: those that the scene asks for, and the others.
json residency(const ResidentVolume& volume, const ResolvedView& view, const Plan& plan) {
  std::map<std::string, std::uint64_t> needed, left_out;
  for (const ResidentPart& part : volume.parts()) {
    const std::string what = part.what + (part.apron ? " with apron" : "");
    if (isNeeded(part, plan)) {
      needed[what] += part.bytes;
    } else {
      left_out[part.level != plan.level ? "other levels" : what] += part.bytes;
    }
  }
  std::uint64_t entries = plan.asksFor(Part::table) ? 0 : kTableEntries;
  for (const Need& need : plan.needs) {
    if (need.part != Part::table) continue;
    entries += bakeTransfer(need.table, volume.info(), static_cast<std::size_t>(need.channel)).entries.size();
  }
  const std::uint64_t sum = sizeof(glm::vec4);
  const auto pixels = static_cast<std::uint64_t>(view.width) * static_cast<std::uint64_t>(view.height);
  (plan.asksFor(Part::table) ? needed : left_out)["table"] = entries * sizeof(std::uint64_t);
  (plan.key.classification == gpu::kClassificationPreIntegrated ? needed : left_out)["integrals"] =
      plan.channels.size() * 2 * kTableEntries * sum;
  (plan.key.antialias != 0 ? needed : left_out)["sums"] = pixels * sum;
  return {{"resident", needed}, {"left_out", left_out}};
}

int largestDifference(const Frame& a, const Frame& b) {
  int largest = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    for (int shift = 0; shift < 32; shift += 8) {
      const int difference =
          static_cast<int>(a.pixels[i] >> shift & 255u) - static_cast<int>(b.pixels[i] >> shift & 255u);
      largest = std::max(largest, std::abs(difference));
    }
  }
  return largest;
}

json measureScene(Renderer& renderer, ResidentVolume& volume, const View& view, const Plan& plan, int samples) {
  std::vector<double> special_ms, general_ms;
  Frame special, general;
  for (int i = 0; i <= samples; ++i) {
    special = renderer.render(volume, view, {.count = false});
    general = renderer.render(volume, view, {.count = false, .general = true});
    if (i == 0) continue;  // compiles
    special_ms.push_back(special.stats.gpu_ms);
    general_ms.push_back(general.stats.gpu_ms);
  }
  return {{"kernel", special.stats.kernel},
          {"instructions", kernelInstructions(plan.key, false)},
          {"ms", median(special_ms)},
          {"general_ms", median(general_ms)},
          {"ratio", median(general_ms) / median(special_ms)},
          {"largest_difference", largestDifference(special, general)}};
}

}  // namespace

json runKernelExperiment(const ExperimentOptions& options) {
  const auto renderer = createRenderer(options.device);
  json result = newRecord("kernels", *renderer, options);
  result["scenes"] = json::array();
  const SceneFiles files(options, {"fossil", "rock", "chip", "vessels", "cells", "smoke"});
  std::vector<Scene> scenes = namedScenes();
  for (const SceneFile& file : files.all()) {
    if (!file.procedural) scenes.push_back({file.name + ", blend", file.name, kPlain});
    if (!file.procedural) scenes.push_back({file.name + ", smooth", file.name, kSmooth});
  }
  const DeviceInfo device = renderer->device();
  const DeviceTraits traits{
      .ray_query = device.ray_query, .software = device.kind == "software", .max_instances = UINT64_MAX};
  std::vector<double> ratios;
  for (const Scene& scene : scenes) {
    if (options.on_step) options.on_step(scene.name);
    const auto volume = renderer->load(VolumeFile(files.named(scene.volume)));
    View view;
    view.width = options.width;
    view.height = options.height;
    scene.look(view, volume->info());
    const ResolvedView resolved = resolveView(view, volume->info());
    const Plan plan = blockwalk::plan(resolved, volume->info(), traits, false, false);
    json entry = measureScene(*renderer, *volume, view, plan, options.samples);
    entry["name"] = scene.name;
    entry["general_instructions"] = kernelInstructions(plan.key, true);
    askForEverything(*renderer, *volume);
    entry.update(residency(*volume, resolved, plan));
    ratios.push_back(entry["ratio"]);
    result["scenes"].push_back(std::move(entry));
  }
  result["median_ratio"] = median(ratios);
  return result;
}

}  // namespace blockwalk::bench
