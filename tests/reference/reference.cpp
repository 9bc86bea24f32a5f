// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/reference.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <thread>

#include "tests/reference/classify.h"
#include "tests/reference/modes.h"
#include "tests/reference/secondary.h"

namespace blockwalk::reference {

double unitDistanceOf(const DenseVolume& volume) {
  const glm::dmat3 axes(volume.world_from_index);
  return std::min({glm::length(axes[0]), glm::length(axes[1]), glm::length(axes[2])});
}

glm::dvec4 overBackground(const View& view, glm::dvec3 premultiplied, double transmittance) {
  const glm::dvec4 background =
      glm::dvec4(view.background[0], view.background[1], view.background[2], view.background[3]) / 255.0;
  const double opacity = 1 - transmittance + transmittance * background.a;
  if (opacity <= 0) return glm::dvec4(0);
  const glm::dvec3 color = (premultiplied + transmittance * background.a * glm::dvec3(background)) / opacity;
  return {glm::min(color, glm::dvec3(1)), opacity};
}

void HalfOpacity::add(double extinction, Interval piece, double value) {
  for (std::size_t i = 0; i < 3; ++i) {
    const double wanted = std::numbers::ln2 + (static_cast<double>(i) - 1) * kHalfMargin;
    if (t_[i] == kNever && depth_ + extinction * (piece.t_max - piece.t_min) >= wanted) {
      t_[i] = piece.t_min + (wanted - depth_) / extinction;
      value_[i] = value;
    }
  }
  depth_ += extinction * (piece.t_max - piece.t_min);
}

void HalfOpacity::show(Pixel& pixel) const {
  pixel.t_early = t_[0];
  pixel.t_late = t_[2];
  pixel.shows_point = t_[1] < kNever;
  if (t_[0] < kNever) pixel.value_early = value_[0];
  if (t_[2] < kNever) pixel.value_late = value_[2];
  if (!pixel.shows_point) return;
  pixel.t = t_[1];
  pixel.value = value_[1];
}

namespace {

void renderNearest(const Scene& scene, const CutRay& cut, Pixel& pixel) {
  switch (scene.view.mode) {
    case Mode::blend:
      return nearestBlend(scene, cut, pixel);
    case Mode::first_hit:
    case Mode::iso:
      return nearestFirstHit(scene, cut, pixel);
    case Mode::mip:
      return nearestMip(scene, cut, pixel);
    case Mode::minip:
      return nearestMinip(scene, cut, pixel);
    case Mode::attenuated_mip:
      return nearestAttenuatedMip(scene, cut, pixel);
    case Mode::mean:
      return nearestMean(scene, cut, pixel);
    case Mode::blocks:
      return countBlocks({&scene.volume, 1}, scene.view, cut, pixel);
  }
}

void renderLinear(const Scene& scene, const CutRay& cut, Pixel& pixel) {
  switch (scene.view.mode) {
    case Mode::blend:
      return linearBlend(scene, cut, pixel);
    case Mode::first_hit:
    case Mode::iso:
      return linearFirstHit(scene, cut, pixel);
    case Mode::mip:
      return linearMip(scene, cut, pixel);
    case Mode::minip:
      return linearMinip(scene, cut, pixel);
    case Mode::attenuated_mip:
      return linearAttenuatedMip(scene, cut, pixel);
    case Mode::mean:
      return linearMean(scene, cut, pixel);
    case Mode::blocks:
      return countBlocks({&scene.volume, 1}, scene.view, cut, pixel);
  }
}

bool takesLightAway(const View& view) {
  const bool shows_surfaces = view.mode == Mode::blend || view.mode == Mode::first_hit || view.mode == Mode::iso;
  return view.lit && shows_surfaces && (view.shadow || view.occlusion > 0);
}

}  // namespace

void renderAlong(const Scene& scene, const CutRay& cut, Pixel& pixel) {
  if (scene.view.filter == Filter::nearest) {
    renderNearest(scene, cut, pixel);
  } else {
    renderLinear(scene, cut, pixel);
  }
}

std::array<std::uint8_t, 4> roundColor(const glm::dvec4& color) {
  std::array<std::uint8_t, 4> result{};
  for (int c = 0; c < 4; ++c) {
    BLOCKWALK_CHECK(color[c], >=, 0.0);
    BLOCKWALK_CHECK(color[c], <=, 1.0 + 1e-9);
    result[static_cast<std::size_t>(c)] = static_cast<std::uint8_t>(std::lround(color[c] * 255));
  }
  return result;
}

TransferPoint transferAt(const std::vector<TransferPoint>& transfer, double value, TransferShape shape) {
  return transferPieceAt(transfer, value, shape).at_value;
}

Pixel renderPixel(const DenseVolume& volume, const View& resolved, int x, int y, glm::dvec2 place, Interval within,
                  int sample) {
  const bool has_lens = resolved.aperture > 0 && resolved.samples > 1;
  CutRay cut = cutRay(volume, resolved, x, y, place, has_lens ? placeOnLens(x, y, sample) : glm::dvec2(0));
  cut.interval.t_min = std::max(cut.interval.t_min, within.t_min);
  cut.interval.t_max = std::min(cut.interval.t_max, within.t_max);
  Pixel pixel;
  pixel.face_distance = faceDistance(cut);
  pixel.color = overBackground(resolved, glm::dvec3(0), 1);
  const Scene scene{.volume = volume, .view = resolved};
  if (!takesLightAway(resolved)) {
    renderAlong(scene, cut, pixel);
    return pixel;
  }
  Pixel rays;  // their distances and margins
  const View left = withLightThatComes(scene, cut, sample, rays);
  renderAlong({.volume = volume, .view = left}, cut, pixel);
  pixel.edge_distance = std::min(pixel.edge_distance, rays.edge_distance);
  pixel.face_distance = std::min(pixel.face_distance, rays.face_distance);
  pixel.lattice_distance = std::min(pixel.lattice_distance, rays.lattice_distance);
  pixel.margin = std::min(pixel.margin, rays.margin);
  return pixel;
}

glm::dvec2 placeOfSample(int x, int y, int index) {
  using Word = std::uint32_t;
  constexpr Word kFactor = 1664525;
  Word a = static_cast<Word>(x) * kFactor + 1013904223, b = static_cast<Word>(y) * kFactor + 1013904223;
  for (int round = 0; round < 2; ++round) {
    a += b * kFactor;
    b += a * kFactor;
    a ^= a >> 16;
    b ^= b >> 16;
  }
  a += static_cast<Word>(index) * Word{3242174889};
  b += static_cast<Word>(index) * Word{2447445414};
  return {std::ldexp(a, -32), std::ldexp(b, -32)};
}

namespace {

constexpr Interval kWholeRay{.t_min = 0, .t_max = std::numeric_limits<double>::infinity()};

Pixel meanPixel(const DenseVolume& volume, const View& view, int x, int y) {
  Pixel mean;
  glm::dvec4 sum(0);
  for (int i = 0; i < view.samples; ++i) {
    const Pixel pixel = renderPixel(volume, view, x, y, placeOfSample(x, y, i), kWholeRay, i);
    sum += glm::dvec4(glm::dvec3(pixel.color) * pixel.color.a, pixel.color.a);
    mean.edge_distance = std::min(mean.edge_distance, pixel.edge_distance);
    mean.face_distance = std::min(mean.face_distance, pixel.face_distance);
    mean.lattice_distance = std::min(mean.lattice_distance, pixel.lattice_distance);
    mean.margin = std::min(mean.margin, pixel.margin);
  }
  if (sum.a > 0) mean.color = glm::dvec4(glm::dvec3(sum) / sum.a, sum.a / view.samples);
  return mean;
}

}  // namespace

Image renderEach(const View& view, const std::function<Pixel(int x, int y)>& render) {
  Image image{.width = view.width, .height = view.height};
  image.pixels.resize(static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height));
  std::atomic<int> next_row{0};
  const auto work = [&] {
    for (int y = next_row++; y < view.height; y = next_row++) {
      for (int x = 0; x < view.width; ++x) {
        const std::size_t index =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width) + static_cast<std::size_t>(x);
        image.pixels[index] = render(x, y);
      }
    }
  };
  std::vector<std::jthread> threads;
  for (unsigned i = 1; i < std::thread::hardware_concurrency(); ++i) threads.emplace_back(work);
  work();
  return image;
}

Image renderImage(const DenseVolume& volume, const View& resolved) {
  return renderEach(resolved, [&](int x, int y) {
    return resolved.samples > 1 ? meanPixel(volume, resolved, x, y) : renderPixel(volume, resolved, x, y);
  });
}

}  // namespace blockwalk::reference
