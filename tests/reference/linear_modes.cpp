// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "tests/reference/classify.h"
#include "tests/reference/field.h"
#include "tests/reference/light.h"
#include "tests/reference/modes.h"

namespace blockwalk::reference {
namespace {

constexpr double kRivalDensity = 1e-4;  // stored units

double middleOf(Interval piece) { return piece.t_min + (piece.t_max - piece.t_min) / 2; }

// One ray through the linearly filtered field of a scene.
class Sampler {
 public:
  Sampler(const Scene& scene, const CutRay& cut)
      : scene_(scene), cut_(cut), classifier_(scene.volume, scene.view), jumps_(classifier_.jumps()) {}

  const Classifier& classifier() const { return classifier_; }
  glm::dvec4 fieldOn(double t) const { return cellOn(t).at(cut_.ray.at(t)); }
  bool isVisible(double t) const { return classifier_.isVisible(fieldOn(t).w); }

  glm::dvec3 shadedColor(glm::dvec3 color, double t) const {
    if (!scene_.view.lit) return color;
    return shade(scene_.volume, scene_.view, cut_.world, color, gradientAt(scene_.volume, cut_.ray.at(t), 0.5));
  }

  // How near the density at t is to where what is seen jumps.
  double marginOn(double t) const {
    double margin = std::numeric_limits<double>::infinity();
    const Cell& cell = cellOn(t);
    if (cell.isFlat()) return margin;
    const double density = cell.at(cut_.ray.at(t)).w;
    for (double jump : jumps_) margin = std::min(margin, std::abs(density - jump));
    return margin;
  }

  // Visits the samples in order: visit(piece, t) -> false to stop. Measures their margins.
  template <typename Visit>
  void walk(Pixel& pixel, Visit visit) const {
    const Lattice lattice = latticeOf(scene_.volume, scene_.view, cut_);
    pixel.edge_distance = cut_.edge_distance;
    if (!(cut_.interval.t_max > cut_.interval.t_min)) return;
    pixel.lattice_distance = latticeDistance(lattice, cut_.interval);
    walkLattice(lattice, cut_.interval, [&](Interval piece) {
      pixel.margin = std::min(pixel.margin, marginOn(middleOf(piece)));
      return visit(piece, middleOf(piece));
    });
  }

  // Where the ray becomes visible between `hidden` and `visible`, by bisection until nothing is between the two.
  double refine(double hidden, double visible) const {
    for (double middle = (hidden + visible) / 2; middle != hidden && middle != visible;
         middle = (hidden + visible) / 2) {
      (isVisible(middle) ? visible : hidden) = middle;
    }
    return visible;
  }

  // What is shown of one point of the ray.
  void show(double t, Pixel& pixel) const {
    const glm::dvec3 position = cut_.ray.at(t);
    const glm::dvec4 field = fieldOn(t);
    pixel.t = t;
    pixel.shows_point = true;
    pixel.voxel = glm::clamp(glm::ivec3(glm::floor(position)), glm::ivec3(0), scene_.volume.dims - 1);
    pixel.value = classifier_.dataOf(field.w);
    pixel.color = overBackground(scene_.view, classifier_.materialAt(field).color, 0);
  }

  // How near a density that is coloured at the end is to where the transfer function jumps.
  double marginOfShown(double density) const {
    double margin = std::numeric_limits<double>::infinity();
    for (double jump : classifier_.transferJumps()) margin = std::min(margin, std::abs(density - jump));
    return margin;
  }

 private:
  // Of eight voxels, which are looked up once a place: each is asked about several times.
  const Cell& cellOn(double t) const {
    if (t != cell_t_) cell_ = cellAround(scene_.volume, cut_.ray.at(t));
    cell_t_ = t;
    return cell_;
  }

  Scene scene_;
  const CutRay& cut_;
  Classifier classifier_;
  std::vector<double> jumps_;
  mutable Cell cell_{};
  mutable double cell_t_ = std::numeric_limits<double>::quiet_NaN();  // equal to none
};

}  // namespace

void linearBlend(const Scene& scene, const CutRay& cut, Pixel& pixel) {
  const Sampler sampler(scene, cut);
  const double unit = unitDistanceOf(scene.volume);
  const bool between_ends =
      scene.view.classification == Classification::pre_integrated && scene.volume.type != VoxelType::rgba8;
  double transmittance = 1;
  HalfOpacity half;
  glm::dvec3 light(0);
  const auto add = [&](const Material& material, Interval piece) {
    if (!(material.sigma > 0)) return;
    const double optical_depth = material.sigma * ((piece.t_max - piece.t_min) / unit);
    half.add(material.sigma / unit, piece);
    light += transmittance * -std::expm1(-optical_depth) * sampler.shadedColor(material.color, middleOf(piece));
    transmittance *= std::exp(-optical_depth);
  };
  sampler.walk(pixel, [&](Interval piece, double t) {
    if (between_ends) {
      walkCells(cut.ray, scene.volume.subblock_side, piece, [&](glm::ivec3, Interval part) {
        add(sampler.classifier().meanMaterial(sampler.fieldOn(part.t_min).w, sampler.fieldOn(part.t_max).w), part);
        return true;
      });
    } else if (sampler.isVisible(t)) {
      add(sampler.classifier().materialAt(sampler.fieldOn(t)), piece);
    }
    return true;
  });
  pixel.color = overBackground(scene.view, light, transmittance);
  half.show(pixel);
}

void linearFirstHit(const Scene& scene, const CutRay& cut, Pixel& pixel) {
  const Sampler sampler(scene, cut);
  double before = cut.interval.t_min;
  sampler.walk(pixel, [&](Interval, double t) {
    if (!sampler.isVisible(t)) {
      before = t;
      return true;
    }
    const bool first = before == cut.interval.t_min;
    if (first) pixel.margin = std::min(pixel.margin, sampler.marginOn(before));
    pixel.at_entry = first && sampler.isVisible(before);
    const double hit = pixel.at_entry ? before : sampler.refine(before, t);
    sampler.show(hit, pixel);
    pixel.color = overBackground(
        scene.view, sampler.shadedColor(sampler.classifier().materialAt(sampler.fieldOn(hit)).color, hit), 0);
    const Cell cell = cellAround(scene.volume, cut.ray.at(hit));
    pixel.slope = cubicAlong(cell, cut.ray, hit).slopeAt(hit);
    return false;
  });
}

void linearMip(const Scene& scene, const CutRay& cut, Pixel& pixel) {
  const Sampler sampler(scene, cut);
  double largest = -std::numeric_limits<double>::infinity(), t_largest = 0;
  std::vector<glm::dvec4> visible;
  sampler.walk(pixel, [&](Interval, double t) {
    const glm::dvec4 field = sampler.fieldOn(t);
    if (!sampler.classifier().isVisible(field.w)) return true;
    visible.push_back(field);
    if (!(field.w > largest)) return true;
    largest = field.w;
    t_largest = t;
    return true;
  });
  if (visible.empty()) return;
  sampler.show(t_largest, pixel);
  pixel.margin = std::min(pixel.margin, sampler.marginOfShown(largest));
  if (scene.volume.type != VoxelType::rgba8) return;
  const glm::dvec3 shown = sampler.classifier().materialAt(sampler.fieldOn(t_largest)).color;
  for (const glm::dvec4& field : visible) {
    if (field.w < largest - kRivalDensity) continue;
    const glm::dvec3 difference = glm::abs(sampler.classifier().materialAt(field).color - shown);
    pixel.rival_difference = std::max({pixel.rival_difference, difference.r, difference.g, difference.b});
  }
}

void linearMean(const Scene& scene, const CutRay& cut, Pixel& pixel) {
  const Sampler sampler(scene, cut);
  double length = 0;
  glm::dvec4 sum(0);
  sampler.walk(pixel, [&](Interval piece, double t) {
    const glm::dvec4 field = sampler.fieldOn(t);
    if (!sampler.classifier().isVisible(field.w)) return true;
    length += piece.t_max - piece.t_min;
    sum += (piece.t_max - piece.t_min) * field;
    return true;
  });
  pixel.visible_length = length;
  if (!(length > 0)) return;
  pixel.value = sampler.classifier().dataOf(sum.w / length);
  pixel.margin = std::min(pixel.margin, sampler.marginOfShown(sum.w / length));
  pixel.color = overBackground(scene.view, sampler.classifier().materialAt(sum / length).color, 0);
}

}  // namespace blockwalk::reference
