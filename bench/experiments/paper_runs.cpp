// SPDX-License-Identifier: Apache-2.0
#include "bench/experiments/paper_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numeric>

#include "protocol/image_codec.h"
#include "protocol/render_json.h"

namespace blockwalk::bench {

using nlohmann::json;

View with(View view, const Choice& choice) {
  view.finder = choice.finder;
  view.walk = choice.walk;
  view.cull = choice.cull;
  view.macrocell = choice.macrocell;
  return view;
}

json spread(std::vector<double> values) {
  std::ranges::sort(values);
  const auto at = [&](double share) {
    return values[static_cast<std::size_t>(std::lround(share * static_cast<double>(values.size() - 1)))];
  };
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  return {{"mean", sum / static_cast<double>(values.size())}, {"q1", at(0.25)}, {"median", at(0.5)}, {"q3", at(0.75)}};
}

json timeChoices(Renderer& renderer, ResidentVolume& volume, const View& view, std::span<const Choice> choices,
                 int samples, bool force_rebuild) {
  json runs = json::array();
  std::vector<std::vector<double>> times(choices.size());
  for (const Choice& choice : choices) {
    const View chosen = with(view, choice);
    const json stats = statsJson(renderer.render(volume, chosen, {.count = true}).stats);
    json run{{"choice", choice.name}, {"walk", choice.walk}, {"cull", choice.cull}, {"macrocell", choice.macrocell}};
    for (const char* name : {"finder", "queries", "block_visits", "subblock_visits", "voxel_steps"})
      run[name] = stats[name];
    runs.push_back(std::move(run));
    renderer.render(volume, chosen, {.count = false});  // compiles
  }
  std::vector<std::vector<double>> tf(choices.size()), tris(choices.size()), bvh(choices.size()), total(choices.size());
  for (int i = 0; i < samples; ++i) {
    for (std::size_t c = 0; c < choices.size(); ++c) {
      const View chosen = with(view, choices[c]);
      renderer.render(volume, chosen, {.count = false});  // bands are as high as the last frame's time says
      const RenderStats stats = renderer.render(volume, chosen, {.count = false, .rebuild = force_rebuild}).stats;
      const FinderBuild& build = stats.finder_build;
      times[c].push_back(stats.gpu_ms + (build.rebuilt ? build.total_ms : 0));
      if (!build.rebuilt) continue;
      tf[c].push_back(build.tf_ms);
      tris[c].push_back(build.tris_ms);
      bvh[c].push_back(build.bvh_ms);
      total[c].push_back(build.total_ms);
      runs[c]["build"] = {{"cells", build.cells},
                          {"active_cells", build.active_cells},
                          {"primitives", build.primitives},
                          {"bytes", build.bytes}};
    }
  }
  for (std::size_t c = 0; c < choices.size(); ++c) {
    runs[c]["ms"] = spread(times[c]);
    if (total[c].empty()) continue;
    json& build = runs[c]["build"];
    build["tf_ms"] = spread(tf[c])["median"];
    build["tris_ms"] = spread(tris[c])["median"];
    build["bvh_ms"] = spread(bvh[c])["median"];
    build["total_ms"] = spread(total[c])["median"];
  }
  return runs;
}

json residentBytes(const ResidentVolume& volume) {
  json parts = json::object();
  for (const ResidentPart& part : volume.parts()) {
    const std::string what = part.what + (part.apron ? " with ring" : "");
    parts[what] = parts.value(what, std::uint64_t{0}) + part.bytes;
  }
  return parts;
}

void writePicture(const ExperimentOptions& options, const std::string& name, const Frame& frame) {
  if (options.pictures.empty()) return;
  std::filesystem::create_directories(options.pictures);
  const std::filesystem::path path = options.pictures / (name + ".png");
  const std::vector<std::byte> bytes = encodeImage(frame, ImageFormat::png, 85);
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) throw DataError(fmt::format("{}: cannot be written", path.string()));
}

}  // namespace blockwalk::bench
