// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>

#include "tests/reference/classify.h"
#include "tests/reference/field.h"
#include "tests/reference/light.h"
#include "tests/reference/modes.h"

namespace blockwalk::reference {
namespace {

constexpr double kRivalDensity = 1e-4;  // stored units
constexpr double kRivalShare = 1e-6;    // of the range, as attenuated

double middleOf(Interval piece) { return piece.t_min + (piece.t_max - piece.t_min) / 2; }

// A visible sample. `is_flat`: it lies among equal voxels, so that any arithmetic gets just their value.
struct Sample {
  glm::dvec4 field{0};
  double t = 0;
  double rank = 0;  // by which one is chosen: its density, or its share of the range as attenuated
  bool is_flat = false;
};

// The largest difference between the colour of the sample that is shown and of another that a rounding may choose.
double rivalDifference(const Classifier& classifier, const std::vector<Sample>& visible, const Sample& shown,
                       double near) {
  double largest = 0;
  const glm::dvec3 color = classifier.materialAt(shown.field).color;
  for (const Sample& other : visible) {
    if (std::abs(other.rank - shown.rank) > near || (other.is_flat && shown.is_flat)) continue;
    const glm::dvec3 difference = glm::abs(classifier.materialAt(other.field).color - color);
    largest = std::max({largest, difference.r, difference.g, difference.b});
  }
  return largest;
}

// One ray through the linearly filtered field of a scene.
class Sampler {
 public:
  Sampler(const Scene& scene, const CutRay& cut)
      : scene_(scene), cut_(cut), classifier_(scene.volume, scene.view), jumps_(classifier_.jumps()) {}

  const Classifier& classifier() const { return classifier_; }
  glm::dvec4 fieldOn(double t) const { return cellOn(t).at(cut_.ray.at(t)); }
  bool isVisible(double t) const { return classifier_.isVisible(fieldOn(t).w); }
  bool isFlatOn(double t) const { return cellOn(t).isFlat(); }

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

  // Mode minip: the sample at t, of the voxel that the place lies in and of those of the cell's others that are
  // visible; nothing where it is not visible itself. `margin`: how near the place is to the face of one that differs, a
  // voxel taken as the contrast.
  std::optional<Sample> visibleSampleOn(double t, double& margin) const {
    const Cell& cell = cellOn(t);
    const glm::dvec3 w = cut_.ray.at(t) - 0.5 - cell.base;
    const auto isShown = [&](std::size_t corner) { return classifier_.isVisible(cell.corners[corner].w); };
    std::size_t own = 0, shown = 0;
    for (std::size_t a = 0; a < 3; ++a) own |= w[static_cast<int>(a)] >= 0.5 ? std::size_t{1} << a : 0;
    // By what they differ from the voxel's own: of equal ones the first counts, so that these have to be equal.
    glm::dvec4 difference(0);
    double weights = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      if (!isShown(i)) continue;
      double weight = 1;
      for (int a = 0; a < 3; ++a) weight *= (i >> a & 1) != 0 ? w[a] : 1 - w[a];
      ++shown;
      weights += weight;
      difference += weight * (cell.corners[i] - cell.corners[own]);
    }
    for (int a = 0; a < 3 && shown > 0 && shown < 8; ++a) {
      margin = std::min(margin, std::abs(w[a] - 0.5) * scene_.volume.contrast);
    }
    if (!isShown(own)) return {};
    const glm::dvec4 field = cell.corners[own] + difference / weights;
    return Sample{.field = field, .t = t, .rank = field.w, .is_flat = difference.w == 0};
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
  const auto add = [&](const Material& material, Interval piece, double density) {
    if (!(material.sigma > 0)) return;
    const double optical_depth = material.sigma * ((piece.t_max - piece.t_min) / unit);
    half.add(material.sigma / unit, piece, sampler.classifier().dataOf(density));
    light += transmittance * -std::expm1(-optical_depth) * sampler.shadedColor(material.color, middleOf(piece));
    transmittance *= std::exp(-optical_depth);
  };
  sampler.walk(pixel, [&](Interval piece, double t) {
    if (between_ends) {
      walkCells(cut.ray, scene.volume.subblock_side, piece, [&](glm::ivec3, Interval part) {
        const double front = sampler.fieldOn(part.t_min).w;
        const double back = sampler.fieldOn(part.t_max).w;
        add(sampler.classifier().meanMaterial(front, back), part, 0.5 * (front + back));
        return true;
      });
    } else if (sampler.isVisible(t)) {
      add(sampler.classifier().materialAt(sampler.fieldOn(t)), piece, sampler.fieldOn(t).w);
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
  std::vector<Sample> visible;
  sampler.walk(pixel, [&](Interval, double t) {
    const glm::dvec4 field = sampler.fieldOn(t);
    if (!sampler.classifier().isVisible(field.w)) return true;
    visible.push_back({.field = field, .t = t, .rank = field.w, .is_flat = sampler.isFlatOn(t)});
    return true;
  });
  if (visible.empty()) return;
  const Sample& largest = *std::ranges::max_element(visible, {}, &Sample::rank);  // of equal ones the first
  sampler.show(largest.t, pixel);
  pixel.margin = std::min(pixel.margin, sampler.marginOfShown(largest.rank));
  if (scene.volume.type != VoxelType::rgba8) return;
  pixel.rival_difference = rivalDifference(sampler.classifier(), visible, largest, kRivalDensity);
}

void linearMinip(const Scene& scene, const CutRay& cut, Pixel& pixel) {
  const Sampler sampler(scene, cut);
  double margin = kInfinity;
  std::vector<Sample> visible;
  sampler.walk(pixel, [&](Interval, double t) {
    if (const std::optional<Sample> sample = sampler.visibleSampleOn(t, margin)) visible.push_back(*sample);
    return true;
  });
  pixel.margin = margin;  // what is visible is whole voxels
  if (visible.empty()) return;
  const Sample& least = *std::ranges::min_element(visible, {}, &Sample::rank);  // of equal ones the first
  sampler.show(least.t, pixel);
  const Classifier& classifier = sampler.classifier();
  pixel.value = classifier.dataOf(least.rank);
  pixel.color = overBackground(scene.view, classifier.materialAt(least.field).color, 0);
  pixel.margin = std::min(margin, sampler.marginOfShown(least.rank));
  if (scene.volume.type != VoxelType::rgba8) return;
  pixel.rival_difference = rivalDifference(classifier, visible, least, kRivalDensity);
}

// Samples in the middle of their pieces: half of its own piece attenuates a sample.
void linearAttenuatedMip(const Scene& scene, const CutRay& cut, Pixel& pixel) {
  const Sampler sampler(scene, cut);
  const Classifier& classifier = sampler.classifier();
  std::vector<Sample> visible;
  double passed = 0;
  sampler.walk(pixel, [&](Interval piece, double t) {
    const glm::dvec4 field = sampler.fieldOn(t);
    if (!classifier.isVisible(field.w)) return true;
    const double share = classifier.shareOf(field.w);
    const double half = 0.5 * share * (piece.t_max - piece.t_min) / unitDistanceOf(scene.volume);
    const double attenuated = share * std::exp(-scene.view.attenuation * (passed + half));
    visible.push_back({.field = field, .t = t, .rank = attenuated});
    passed += 2 * half;
    return true;
  });
  if (visible.empty()) return;
  const Sample& largest = *std::ranges::max_element(visible, {}, &Sample::rank);  // of equal ones the first
  sampler.show(largest.t, pixel);
  const double density = classifier.densityAt(largest.rank);
  const bool has_colors = scene.volume.type == VoxelType::rgba8;
  const glm::dvec4 shown = has_colors ? largest.field : glm::dvec4(0, 0, 0, density);
  pixel.value = classifier.dataOf(density);
  pixel.color = overBackground(scene.view, classifier.materialAt(shown).color, 0);
  pixel.margin = std::min(pixel.margin, sampler.marginOfShown(density));
  if (has_colors) pixel.rival_difference = rivalDifference(classifier, visible, largest, kRivalShare);
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
