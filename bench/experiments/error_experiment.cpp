// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "bench/experiments/codec_trip.h"
#include "bench/experiments/error_budget.h"
#include "bench/experiments/experiments.h"
#include "bench/experiments/image_error.h"
#include "bench/experiments/record.h"
#include "bench/experiments/scene_files.h"
#include "tests/reference/converged.h"
#include "tests/reference/pixel_mean.h"

namespace blockwalk::bench {
namespace {

using nlohmann::json;

// What a picture is held against: the integral along the rays through the pixels' centres, or its mean over the pixels'
// areas.
enum class Truth { centre, pixel };

// One setting of one knob; everything else is as in the default picture.
struct Setting {
  std::string knob;
  std::string value;
  bool is_default = false;
  View view;
  int scale = 1;    // rendered at a 1/scale of the size each way, and enlarged
  int quality = 0;  // through a codec at this quality, 0: not
  ImageFormat codec = ImageFormat::jpeg;
  Truth truth = Truth::centre;
};

// The default picture of a scientific view: linear filter, step 1/2, post-classified.
View defaultLook(const ExperimentOptions& options, const VolumeInfo& info) {
  View view;
  view.width = options.width;
  view.height = options.height;
  view.filter = Filter::linear;
  view.level = 0;
  return spellOut(resolveView(view, info));
}

std::vector<Setting> settingsFor(const View& base, const VolumeInfo& info) {
  std::vector<Setting> settings;
  const auto add = [&](std::string knob, std::string value, bool is_default, auto change) {
    Setting setting{.knob = std::move(knob), .value = std::move(value), .is_default = is_default, .view = base};
    change(setting);
    settings.push_back(std::move(setting));
  };
  for (double step : {4.0, 2.0, 1.0, 0.5, 0.25, 0.125, 0.0625}) {
    add("step", fmt::format("{}", step), step == base.step, [&](Setting& s) { s.view.step = step; });
    if (info.type == VoxelType::rgba8) continue;
    add("pre-integrated step", fmt::format("{}", step), false, [&](Setting& s) {
      s.view.step = step;
      s.view.classification = Classification::pre_integrated;
    });
  }
  for (Filter filter : {Filter::nearest, Filter::linear}) {
    const bool linear = filter == Filter::linear;
    add("filter", linear ? "linear" : "nearest", linear, [&](Setting& s) { s.view.filter = filter; });
  }
  for (int exponent : {4, 6, 8, 10, 12, 14, 16}) {
    const double bound = std::ldexp(1.0, -exponent);
    add("termination", fmt::format("2^-{}", exponent), bound == base.termination,
        [&](Setting& s) { s.view.termination = bound; });
  }
  for (int level = 0; level < std::min(4, static_cast<int>(info.levels.size())); ++level) {
    add("level", fmt::format("{}", level), level == 0, [&](Setting& s) { s.view.level = level; });
  }
  for (int scale : {1, 2, 4}) {
    add("scale", fmt::format("1/{}", scale), scale == 1, [&](Setting& s) { s.scale = scale; });
  }
  for (int quality : {30, 50, 70, 85, 95}) {
    for (ImageFormat codec : {ImageFormat::jpeg, ImageFormat::webp}) {
      add(std::string(imageFormatName(codec)), fmt::format("{}", quality), quality == 85, [&](Setting& s) {
        s.quality = quality;
        s.codec = codec;
      });
    }
  }
  add("webp", fmt::format("{}", kLosslessWebp), false, [](Setting& s) {
    s.quality = kLosslessWebp;
    s.codec = ImageFormat::webp;
  });
  for (int samples : {1, 2, 4, 8, 16}) {
    add("samples", fmt::format("{}", samples), samples == base.samples, [&](Setting& s) {
      s.view.samples = samples;
      s.truth = Truth::pixel;
    });
  }
  return settings;
}

// Bilinear between pixel centres, as a canvas enlarges.
std::vector<std::uint32_t> enlarged(const std::vector<std::uint32_t>& pixels, int width, int height, int to_width,
                                    int to_height) {
  std::vector<std::uint32_t> result(static_cast<std::size_t>(to_width) * static_cast<std::size_t>(to_height));
  const auto at = [&](int x, int y) {
    return pixels[static_cast<std::size_t>(std::clamp(y, 0, height - 1) * width + std::clamp(x, 0, width - 1))];
  };
  for (int y = 0; y < to_height; ++y) {
    for (int x = 0; x < to_width; ++x) {
      const double sx = (x + 0.5) * width / to_width - 0.5, sy = (y + 0.5) * height / to_height - 0.5;
      const int x0 = static_cast<int>(std::floor(sx)), y0 = static_cast<int>(std::floor(sy));
      std::uint32_t pixel = 0;
      for (int c = 0; c < 4; ++c) {
        const auto channel = [&](int i, int j) { return static_cast<double>(at(x0 + i, y0 + j) >> (8 * c) & 255u); };
        const double top = channel(0, 0) + (channel(1, 0) - channel(0, 0)) * (sx - x0);
        const double bottom = channel(0, 1) + (channel(1, 1) - channel(0, 1)) * (sx - x0);
        pixel |= static_cast<std::uint32_t>(std::lround(top + (bottom - top) * (sy - y0))) << (8 * c);
      }
      result[static_cast<std::size_t>(y * to_width + x)] = pixel;
    }
  }
  return result;
}

struct Truths {
  ColorImage centre;
  ColorImage pixel;
  const ColorImage& of(Truth truth) const { return truth == Truth::pixel ? pixel : centre; }
};

json measure(Renderer& renderer, ResidentVolume& volume, const Setting& setting, const Truths& truths, int repeats) {
  View view = setting.view;
  view.width = std::max(1, view.width / setting.scale);
  view.height = std::max(1, view.height / setting.scale);
  const FrameOrder options{.count = false};
  std::vector<double> times;
  Frame frame;
  for (int i = 0; i <= repeats; ++i) {
    frame = renderer.render(volume, view, options);
    if (i > 0) times.push_back(frame.stats.gpu_ms);  // the first compiles and loads
  }
  json run{{"knob", setting.knob}, {"value", setting.value}, {"default", setting.is_default}};
  run["ms"] = median(times);
  if (setting.scale > 1) {
    frame.pixels = enlarged(frame.pixels, view.width, view.height, setting.view.width, setting.view.height);
  }
  if (setting.quality > 0) {
    CodecTrip trip = throughCodec(frame, setting.codec, setting.quality, repeats);
    run["encode_ms"] = trip.encode_ms;
    run["bytes"] = trip.bytes;
    frame.pixels = std::move(trip.pixels);
  }
  run["truth"] = setting.truth == Truth::pixel ? "pixel" : "centre";
  const ImageError error =
      imageError(colorsOf(frame.pixels, setting.view.width, setting.view.height), truths.of(setting.truth));
  run["rmse"] = error.rmse;
  run["max"] = error.largest;
  run["psnr"] = error.psnr;
  run["ssim"] = error.ssim;
  return run;
}

}  // namespace

json runErrorExperiment(const ExperimentOptions& options) {
  const auto renderer = createRenderer(options.device);
  json result = newRecord("error", *renderer, options);
  result["scenes"] = json::array();
  const SceneFiles scenes(options, {"fossil", "vessels", "cells", "smoke"});
  for (const SceneFile& scene : scenes.all()) {
    const auto say = [&](const std::string& what) {
      if (options.on_step) options.on_step(scene.name + ": " + what);
    };
    const VolumeFile file(scene.path);
    const View base = defaultLook(options, file.info());
    say("integrating the truth");
    const reference::DenseVolume dense = reference::volumeFromFile(file, 0);
    Truths truths{.centre = colorsOf(reference::renderImageConverged(dense, base)), .pixel = {}};
    say("integrating its mean over the pixels");
    truths.pixel = colorsOf(reference::renderImageMean(dense, base));
    const auto volume = renderer->load(VolumeFile(scene.path));
    json runs = json::array();
    for (const Setting& setting : settingsFor(base, file.info())) {
      say(setting.knob + " " + setting.value);
      runs.push_back(measure(*renderer, *volume, setting, truths, options.samples));
    }
    say("orders of convergence, and the budget");
    result["scenes"].push_back({{"name", scene.name},
                                {"type", voxelTypeName(file.info().type)},
                                {"orders", convergenceOrders(dense, base, truths.centre)},
                                {"budget", errorBudget(*renderer, *volume, dense, base, truths.centre)},
                                {"runs", std::move(runs)}});
  }
  return result;
}

}  // namespace blockwalk::bench
