// SPDX-License-Identifier: Apache-2.0
// Several channels together (docs/integration.md, Channels).
#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/reference/classify.h"
#include "tests/reference/field.h"
#include "tests/reference/light.h"
#include "tests/reference/modes.h"
#include "volume/error.h"

namespace blockwalk::reference {
namespace {

double middleOf(Interval piece) { return piece.t_min + (piece.t_max - piece.t_min) / 2; }

// What the visible channels of a point are together.
struct Mixture {
  double sigma = 0;
  glm::dvec3 emission{0};
  bool visible = false;

  void add(const Material& material) {
    sigma += material.sigma;
    emission += material.sigma * material.color;
    visible = true;
  }
  glm::dvec3 color() const { return emission / sigma; }
};

class Channel {
 public:
  Channel(const DenseVolume& volume, const View& view, const CutRay& cut)
      : volume_(volume), view_(view), cut_(cut), classifier_(volume, view), jumps_(classifier_.jumps()) {}

  const DenseVolume& volume() const { return volume_; }

  void addVoxel(glm::ivec3 cell, Mixture& mixture) const {
    const float density = volume_.density[volume_.at(cell)];
    if (!std::isfinite(density) || !classifier_.isVisible(static_cast<double>(density))) return;
    Material material = classifier_.materialAt({0, 0, 0, static_cast<double>(density)});
    light(material, glm::dvec3(cell) + 0.5, 1);
    mixture.add(material);
  }

  bool isVisible(double t) const { return classifier_.isVisible(fieldOn(t).w); }

  void addPoint(double t, Mixture& mixture) const {
    if (!isVisible(t)) return;
    Material material = classifier_.materialAt(fieldOn(t));
    light(material, cut_.ray.at(t), 0.5);
    mixture.add(material);
  }

  // The field taken to be linear between the ends of a piece.
  void addBetween(Interval piece, Mixture& mixture) const {
    Material material = classifier_.meanMaterial(fieldOn(piece.t_min).w, fieldOn(piece.t_max).w);
    if (!(material.sigma > 0)) return;
    light(material, cut_.ray.at(middleOf(piece)), 0.5);
    mixture.add(material);
  }

  // How near the density at t is to where what is seen of this channel jumps, of the contrast.
  double marginOn(double t) const {
    const Cell cell = cellAround(volume_, cut_.ray.at(t));
    if (cell.isFlat()) return kInfinity;
    double margin = kInfinity;
    for (double jump : jumps_) margin = std::min(margin, std::abs(cell.at(cut_.ray.at(t)).w - jump));
    return margin / volume_.contrast;
  }

 private:
  glm::dvec4 fieldOn(double t) const { return fieldAt(volume_, cut_.ray.at(t)); }

  void light(Material& material, glm::dvec3 position, double reach) const {
    if (!view_.lit) return;
    material.color = shade(volume_, view_, cut_.world, material.color, gradientAt(volume_, position, reach));
  }

  const DenseVolume& volume_;
  const View& view_;
  const CutRay& cut_;
  Classifier classifier_;
  std::vector<double> jumps_;
};

using Channels = std::vector<Channel>;

// Front to back, piece by piece of constant extinction.
class Composition {
 public:
  Composition(const View& view, double unit_distance) : view_(view), unit_(unit_distance) {}

  void add(const Mixture& mixture, Interval piece) {
    if (!(mixture.sigma > 0)) return;
    const double optical_depth = mixture.sigma * ((piece.t_max - piece.t_min) / unit_);
    half_.add(mixture.sigma / unit_, piece, std::numeric_limits<double>::quiet_NaN());
    light_ += transmittance_ * -std::expm1(-optical_depth) * mixture.color();
    transmittance_ *= std::exp(-optical_depth);
  }

  void show(Pixel& pixel) const {
    pixel.color = overBackground(view_, light_, transmittance_);
    half_.show(pixel);
  }

 private:
  const View& view_;
  double unit_;
  double transmittance_ = 1;
  glm::dvec3 light_{0};
  HalfOpacity half_;
};

void nearestMixture(const Channels& channels, const View& view, const CutRay& cut, Pixel& pixel) {
  Composition composition(view, unitDistanceOf(channels[0].volume()));
  walkCells(cut.ray, 1, cut.interval, [&](glm::ivec3 cell, Interval piece) {
    Mixture mixture;
    for (const Channel& channel : channels) channel.addVoxel(cell, mixture);
    if (view.mode == Mode::blend) {
      composition.add(mixture, piece);
      return true;
    }
    if (!mixture.visible) return true;
    pixel.voxel = cell;
    pixel.t = piece.t_min;
    pixel.shows_point = true;
    pixel.color = overBackground(view, mixture.color(), 0);
    return false;
  });
  if (view.mode == Mode::blend) composition.show(pixel);
}

// Visits the samples in order, visit(piece) -> false to stop, and measures their margins.
template <typename Visit>
void walkSamples(const Channels& channels, const View& view, const CutRay& cut, Pixel& pixel, Visit visit) {
  if (!(cut.interval.t_max > cut.interval.t_min)) return;
  const Lattice lattice = latticeOf(channels[0].volume(), view, cut);
  pixel.lattice_distance = latticeDistance(lattice, cut.interval);
  walkLattice(lattice, cut.interval, [&](Interval piece) {
    for (const Channel& channel : channels) pixel.margin = std::min(pixel.margin, channel.marginOn(middleOf(piece)));
    return visit(piece);
  });
}

void linearBlend(const Channels& channels, const View& view, const CutRay& cut, Pixel& pixel) {
  Composition composition(view, unitDistanceOf(channels[0].volume()));
  walkSamples(channels, view, cut, pixel, [&](Interval piece) {
    if (view.classification == Classification::pre_integrated) {
      walkCells(cut.ray, channels[0].volume().subblock_side, piece, [&](glm::ivec3, Interval part) {
        Mixture mixture;
        for (const Channel& channel : channels) channel.addBetween(part, mixture);
        composition.add(mixture, part);
        return true;
      });
    } else {
      Mixture mixture;
      for (const Channel& channel : channels) channel.addPoint(middleOf(piece), mixture);
      composition.add(mixture, piece);
    }
    return true;
  });
  composition.show(pixel);
}

void linearFirstHit(const Channels& channels, const View& view, const CutRay& cut, Pixel& pixel) {
  const auto isVisible = [&](double t) {
    return std::ranges::any_of(channels, [&](const Channel& channel) { return channel.isVisible(t); });
  };
  double before = cut.interval.t_min;
  walkSamples(channels, view, cut, pixel, [&](Interval piece) {
    const double t = middleOf(piece);
    if (!isVisible(t)) {
      before = t;
      return true;
    }
    pixel.at_entry = before == cut.interval.t_min && isVisible(before);
    double hidden = before, shown = pixel.at_entry ? before : t;
    for (double middle = (hidden + shown) / 2; middle != hidden && middle != shown; middle = (hidden + shown) / 2) {
      (isVisible(middle) ? shown : hidden) = middle;
    }
    Mixture mixture;
    for (const Channel& channel : channels) channel.addPoint(shown, mixture);
    pixel.t = shown;
    pixel.shows_point = true;
    pixel.color = overBackground(view, mixture.color(), 0);
    return false;
  });
}

// mip, minip, attenuated-mip, mean: each channel by itself, the colours added.
Pixel addedPixel(std::span<const DenseVolume> drawn, const View& view, int x, int y, glm::dvec2 place) {
  Pixel sum;
  glm::dvec3 color(0);
  bool seen = false;
  for (const DenseVolume& volume : drawn) {
    const Pixel pixel = renderPixel(volume, view, x, y, place);
    sum.face_distance = pixel.face_distance;
    sum.margin = std::min(sum.margin, pixel.margin / volume.contrast);
    sum.lattice_distance = pixel.lattice_distance;
    if (std::isnan(pixel.value)) continue;
    color += glm::dvec3(pixel.color);
    seen = true;
  }
  sum.color = overBackground(view, color, seen ? 0 : 1);
  return sum;
}

}  // namespace

Pixel renderPixel(std::span<const DenseVolume> drawn, const View& resolved, int x, int y, glm::dvec2 place) {
  BLOCKWALK_CHECK(drawn.size(), >, std::size_t{0});
  if (drawn.size() == 1 || resolved.mode == Mode::iso) {
    Pixel pixel = renderPixel(drawn[0], resolved, x, y, place);
    pixel.margin /= drawn[0].contrast;
    return pixel;
  }
  if (showsExtreme(resolved.mode) || resolved.mode == Mode::mean) return addedPixel(drawn, resolved, x, y, place);
  const CutRay cut = cutRay(drawn[0], resolved, x, y, place);
  Pixel pixel;
  pixel.face_distance = faceDistance(cut);
  pixel.color = overBackground(resolved, glm::dvec3(0), 1);
  if (resolved.mode == Mode::blocks) {
    countBlocks(drawn, resolved, cut, pixel);
    return pixel;
  }
  Channels channels;
  channels.reserve(drawn.size());
  for (const DenseVolume& volume : drawn) channels.emplace_back(volume, resolved, cut);
  if (resolved.filter == Filter::nearest) {
    nearestMixture(channels, resolved, cut, pixel);
  } else if (resolved.mode == Mode::blend) {
    linearBlend(channels, resolved, cut, pixel);
  } else {
    linearFirstHit(channels, resolved, cut, pixel);
  }
  return pixel;
}

Image renderImage(std::span<const DenseVolume> drawn, const View& resolved) {
  BLOCKWALK_CHECK(resolved.samples, ==, 1);
  return renderEach(resolved, [&](int x, int y) { return renderPixel(drawn, resolved, x, y, kPixelCentre); });
}

}  // namespace blockwalk::reference
