// SPDX-License-Identifier: Apache-2.0
#include "bench/experiments/error_budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "bench/experiments/codec_trip.h"
#include "tests/reference/converged.h"

namespace blockwalk::bench {
namespace {

using nlohmann::json;

constexpr int kUsualQuality = 85;

// The pictures of a view on the device under every finder that it has, walk and cull.
std::vector<ColorImage> everyTraversal(Renderer& renderer, ResidentVolume& volume, const View& base) {
  std::vector<ColorImage> images;
  for (const Finder finder : {Finder::grid, Finder::query}) {
    if (finder == Finder::query && !renderer.device().ray_query) continue;
    for (const bool walk : {false, true}) {
      for (const bool cull : {false, true}) {
        View view = base;
        view.finder = finder;
        view.walk = walk;
        view.cull = cull;
        images.push_back(colorsOf(renderer.render(volume, view, {.count = false}).pixels, base.width, base.height));
      }
    }
  }
  return images;
}

json orderOf(const reference::DenseVolume& dense, View view, const ColorImage& truth, std::string look) {
  json steps = json::array(), orders = json::array();
  double before = 0;
  for (const double step : {4.0, 2.0, 1.0, 0.5, 0.25, 0.125}) {
    view.step = step;
    const double rmse = imageError(colorsOf(reference::renderImage(dense, view)), truth).rmse;
    steps.push_back({{"step", step}, {"rmse", rmse}});
    if (before > 0) orders.push_back({{"from", 2 * step}, {"to", step}, {"order", std::log2(before / rmse)}});
    before = rmse;
  }
  return {{"look", std::move(look)}, {"steps", std::move(steps)}, {"orders", std::move(orders)}};
}

json orderOf(const reference::DenseVolume& dense, const View& view, std::string look) {
  return orderOf(dense, view, colorsOf(reference::renderImageConverged(dense, view)), std::move(look));
}

}  // namespace

json errorBudget(Renderer& renderer, ResidentVolume& volume, const reference::DenseVolume& dense, const View& base,
                 const ColorImage& truth) {
  json budget = json::array();
  const auto add = [&](std::string_view source, std::string_view how, const ColorImage& a, const ColorImage& b) {
    const ImageError error = imageError(a, b);
    budget.push_back({{"source", source}, {"how", how}, {"rmse", error.rmse}, {"max", error.largest}});
  };
  const auto drawn = [&](const View& view) { return renderer.render(volume, view, {.count = false}); };
  const Frame frame = drawn(base);
  const ColorImage picture = colorsOf(frame.pixels, base.width, base.height);
  const ColorImage stepped = colorsOf(reference::renderImage(dense, base));
  View whole = base;
  whole.termination = 0;
  const ColorImage unended = colorsOf(drawn(whole).pixels, base.width, base.height);
  View nearest = base;
  nearest.filter = Filter::nearest;

  add("all together", "the picture against the integral", picture, truth);
  add("filter", "nearest instead of linear, both exact in float64", colorsOf(reference::renderImage(dense, nearest)),
      truth);
  add("step", "the lattice in float64 against the integral", stepped, truth);
  add("8-bit output", "the integral rounded against itself", roundedColors(truth), truth);
  add("float arithmetic and tables", "without early ends, against the rounded lattice in float64", unended,
      roundedColors(stepped));
  add("termination", "the picture against the same without early ends", picture, unended);
  const std::vector<ColorImage> traversals = everyTraversal(renderer, volume, base);
  const auto& farthest = *std::ranges::max_element(
      traversals, {}, [&](const ColorImage& image) { return imageError(image, picture).largest; });
  add("traversal", "every finder, walk and cull: the one that differs most from the picture", farthest, picture);
  for (const ImageFormat format : {ImageFormat::jpeg, ImageFormat::webp}) {
    const CodecTrip trip = throughCodec(frame, format, kUsualQuality, 1);
    add("codec", fmt::format("{} {} against the picture", imageFormatName(format), kUsualQuality),
        colorsOf(trip.pixels, base.width, base.height), picture);
  }
  return budget;
}

json convergenceOrders(const reference::DenseVolume& dense, const View& base, const ColorImage& truth) {
  json orders = json::array({orderOf(dense, base, truth, "the picture")});
  View cut = base;
  DensityRange& range = *cut.channels[0].range;
  range.lo = 0.5 * (range.lo + range.hi);
  orders.push_back(orderOf(dense, cut, "a range that cuts"));
  if (!base.channels[0].transfer.empty()) {
    View steps = base;
    steps.transfer_shape = TransferShape::stepped;
    orders.push_back(orderOf(dense, steps, "a stepped transfer function"));
  }
  return orders;
}

}  // namespace blockwalk::bench
