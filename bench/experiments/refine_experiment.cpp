// SPDX-License-Identifier: Apache-2.0
// What it costs to draw a picture's samples in steps of 1, 2, 4, 8 ... instead of at once: wall time of the renderer's
// calls, and with the encoding of the pictures that a stream would send on the way. Both ways alternate within one run;
// what is written are medians.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "bench/experiments/experiments.h"
#include "bench/experiments/record.h"
#include "protocol/image_codec.h"

namespace blockwalk::bench {
namespace {

using nlohmann::json;

double msSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
}

struct SampleTimes {
  std::vector<double> first;  // until there is a picture
  std::vector<double> drawn;
  std::vector<double> encoded;  // the pictures on the way too
};

void drawAtOnce(Renderer& renderer, ResidentVolume& volume, const ImageRequest& request, SampleTimes& times) {
  const auto begin = std::chrono::steady_clock::now();
  const Frame frame = renderer.render(volume, request.view, {});
  times.first.push_back(msSince(begin));
  times.drawn.push_back(msSince(begin));
  encodeImage(frame, request.format, request.quality);
  times.encoded.push_back(msSince(begin));
}

void drawInSteps(Renderer& renderer, ResidentVolume& volume, const ImageRequest& request, SampleTimes& times) {
  double drawn = 0, total = 0;
  for (int shown = 0; shown < request.view.samples;) {
    const int end = std::min(std::max(1, 2 * shown), request.view.samples);
    const auto begin = std::chrono::steady_clock::now();
    const Frame frame =
        renderer.render(volume, request.view, {.step = SampleStep{.owner = 1, .begin = shown, .end = end}});
    drawn += msSince(begin);
    if (shown == 0) times.first.push_back(drawn);
    shown = end;
    encodeImage(frame, shown < request.view.samples ? ImageFormat::jpeg : request.format, request.quality);
    total += msSince(begin);
  }
  times.drawn.push_back(drawn);
  times.encoded.push_back(total);
}

json medians(const SampleTimes& times) {
  return {{"first_ms", median(times.first)}, {"drawn_ms", median(times.drawn)}, {"encoded_ms", median(times.encoded)}};
}

json measureRefining(Renderer& renderer, const std::filesystem::path& path, const ImageRequest& request,
                     const ExperimentOptions& options) {
  const auto volume = renderer.load(VolumeFile(path));
  renderer.render(*volume, request.view, {});  // compiles and loads
  SampleTimes once, steps;
  for (int i = 0; i < options.samples; ++i) {
    drawAtOnce(renderer, *volume, request, once);
    drawInSteps(renderer, *volume, request, steps);
  }
  if (options.on_step) {
    options.on_step(path.string());
    for (const auto& [name, times] : {std::pair{"at once", &once}, {"in steps", &steps}}) {
      options.on_step(fmt::format("  {:9} first {:8.1f} ms  all drawn {:8.1f} ms  with encoding {:8.1f} ms", name,
                                  median(times->first), median(times->drawn), median(times->encoded)));
    }
  }
  return {{"file", path.string()},
          {"at_once", medians(once)},
          {"in_steps", medians(steps)},
          {"first_ratio", median(steps.first) / median(once.first)},
          {"drawn_ratio", median(steps.drawn) / median(once.drawn)},
          {"encoded_ratio", median(steps.encoded) / median(once.encoded)}};
}

}  // namespace

json runRefineExperiment(const ExperimentOptions& options, const ImageRequest& request) {
  const auto renderer = createRenderer(options.device);
  json result = newRecord("refine", *renderer, options);
  result["size"] = {request.view.width, request.view.height};
  result["view"] = viewQuery(request);
  for (const auto& file : options.files)
    result["volumes"].push_back(measureRefining(*renderer, file, request, options));
  return result;
}

}  // namespace blockwalk::bench
