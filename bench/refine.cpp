// SPDX-License-Identifier: Apache-2.0
// What it costs to draw a picture's samples in steps of 1, 2, 4, 8 ... instead of at once: wall time of the renderer's
// calls, and with the encoding of the pictures that a stream would send on the way. Both ways alternate within one run;
// medians are printed.
//
// Usage: bench_refine [--repeat N] [--VIEW-MEMBER VALUE]... FILE.bwv...
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/image_codec.h"
#include "protocol/view_fields.h"
#include "renderer/renderer.h"

namespace {

using namespace blockwalk;

struct Options {
  ImageRequest request;
  int repeat = 9;
  std::vector<std::string> files;
};

Options parse(int argc, char** argv) {
  Options options;
  setViewField(options.request, "size", "512x512");
  setViewField(options.request, "samples", "16");
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (!argument.starts_with("--")) {
      options.files.emplace_back(argument);
      continue;
    }
    if (i + 1 == argc) throw std::invalid_argument(fmt::format("{} needs a value", argument));
    const std::string_view value = argv[++i];
    if (argument == "--repeat") {
      options.repeat = std::stoi(std::string(value));
      if (options.repeat < 1) throw std::invalid_argument("--repeat must be at least 1");
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

double msSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
}

struct Times {
  std::vector<double> first;  // until there is a picture
  std::vector<double> drawn;
  std::vector<double> encoded;  // the pictures on the way too
};

void drawAtOnce(Renderer& renderer, ResidentVolume& volume, const ImageRequest& request, Times& times) {
  const auto begin = std::chrono::steady_clock::now();
  const Frame frame = renderer.render(volume, request.view, {});
  times.first.push_back(msSince(begin));
  times.drawn.push_back(msSince(begin));
  encodeImage(frame, request.format, request.quality);
  times.encoded.push_back(msSince(begin));
}

void drawInSteps(Renderer& renderer, ResidentVolume& volume, const ImageRequest& request, Times& times) {
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

void measure(Renderer& renderer, const std::string& path, const Options& options) {
  const auto volume = renderer.load(VolumeFile(path));
  renderer.render(*volume, options.request.view, {});  // compiles and loads
  Times once, steps;
  for (int i = 0; i < options.repeat; ++i) {
    drawAtOnce(renderer, *volume, options.request, once);
    drawInSteps(renderer, *volume, options.request, steps);
  }
  fmt::print("{}\n", path);
  for (const auto& [name, times] : {std::pair{"at once", &once}, {"in steps", &steps}}) {
    fmt::print("  {:9} first {:8.1f} ms  all drawn {:8.1f} ms  with encoding {:8.1f} ms\n", name, median(times->first),
               median(times->drawn), median(times->encoded));
  }
  fmt::print("  ratio     first {:8.3f}     all drawn {:8.3f}     with encoding {:8.3f}\n",
             median(steps.first) / median(once.first), median(steps.drawn) / median(once.drawn),
             median(steps.encoded) / median(once.encoded));
}

}  // namespace

int main(int argc, char** argv) try {
  const Options options = parse(argc, argv);
  const auto renderer = createRenderer({});
  fmt::print("{}, {}x{}, {} samples a pixel\n", renderer->device().name, options.request.view.width,
             options.request.view.height, options.request.view.samples);
  for (const std::string& file : options.files) measure(*renderer, file, options);
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "bench_refine: {}\n", error.what());
  return 1;
}
