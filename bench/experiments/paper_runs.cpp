// SPDX-License-Identifier: Apache-2.0
#include "bench/experiments/paper_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numeric>

#include "bench/experiments/record.h"
#include "protocol/image_codec.h"
#include "protocol/render_json.h"

namespace blockwalk::bench {

using nlohmann::json;

View pictureOf(const ExperimentOptions& options) {
  View view;
  view.width = options.width;
  view.height = options.height;
  view.level = 0;
  return view;
}

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

namespace {

// What was measured of one choice, milliseconds.
struct Times {
  std::vector<double> frame, tf, tris, bvh, total;

  void add(const RenderStats& stats) {
    const FinderBuild& build = stats.finder_build;
    frame.push_back(stats.gpu_ms + (build.rebuilt ? build.total_ms : 0));
    if (!build.rebuilt) return;
    tf.push_back(build.tf_ms);
    tris.push_back(build.tris_ms);
    bvh.push_back(build.bvh_ms);
    total.push_back(build.total_ms);
  }
};

json buildJson(const FinderBuild& build, const Times& times) {
  return {{"macrocells", build.macrocells}, {"active_macrocells", build.active_macrocells},
          {"primitives", build.primitives}, {"bytes", build.bytes},
          {"tf_ms", median(times.tf)},      {"tris_ms", median(times.tris)},
          {"bvh_ms", median(times.bvh)},    {"total_ms", median(times.total)}};
}

}  // namespace

json timeChoices(Renderer& renderer, ResidentVolume& volume, const View& view, std::span<const Choice> choices,
                 int samples, bool force_rebuild) {
  json runs = json::array();
  for (const Choice& choice : choices) {
    const json stats = statsJson(renderer.render(volume, with(view, choice), {.count = true}).stats);
    json run{{"choice", choice.name}, {"walk", choice.walk}, {"cull", choice.cull}, {"macrocell", choice.macrocell}};
    for (const char* name : {"finder", "queries", "block_visits", "subblock_visits", "voxel_steps"})
      run[name] = stats[name];
    runs.push_back(std::move(run));
  }
  std::vector<Times> times(choices.size());
  std::vector<FinderBuild> builds(choices.size());
  for (int i = 0; i < samples; ++i) {
    for (std::size_t c = 0; c < choices.size(); ++c) {
      const View chosen = with(view, choices[c]);
      renderer.render(volume, chosen, {.count = false});  // compiles; bands are as high as the last frame's time says
      const Frame frame = renderer.render(volume, chosen, {.count = false, .rebuild = force_rebuild});
      times[c].add(frame.stats);
      builds[c] = frame.stats.finder_build;
    }
  }
  for (std::size_t c = 0; c < choices.size(); ++c) {
    runs[c]["ms"] = spread(times[c].frame);
    if (!times[c].total.empty()) runs[c]["build"] = buildJson(builds[c], times[c]);
  }
  return runs;
}

json dimsJson(const VolumeInfo& info) { return {info.dims.x, info.dims.y, info.dims.z}; }

json residentBytes(const ResidentVolume& volume) {
  json parts = json::object();
  for (const ResidentPart& part : volume.parts()) {
    const std::string what = part.what + (part.apron ? " with apron" : "");
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
