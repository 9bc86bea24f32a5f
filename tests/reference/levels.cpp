// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include "tests/reference/classify.h"
#include "tests/reference/modes.h"

namespace blockwalk::reference {
namespace {

// Depth before the eye from which on the view is drawn of a level: there a pixel covers `lod` of its voxels in a row.
// Maxima are drawn of the next coarser one, but that the first which has some takes the place of all finer ones.
double depthOf(const DenseVolume& volume, const View& view) {
  const bool maxima = view.mode == Mode::mip && volume.level > 0;
  const double voxel = unitDistanceOf(volume) * std::ldexp(1.0, maxima ? volume.level - 1 : volume.level);
  const double pixel = 2 * std::tan(view.fov_degrees * std::numbers::pi / 360) / view.height;
  return view.lod * voxel / pixel;
}

// The parts of one ray put together.
class Parts {
 public:
  Parts(const View& view, Pixel& pixel) : view_(view), pixel_(pixel) {}

  void add(const DenseVolume& volume, const Pixel& part) {
    switch (view_.mode) {
      case Mode::blend:
        light_ += transmittance_ * part.color.a * glm::dvec3(part.color);
        transmittance_ *= 1 - part.color.a;
        pixel_.color = overBackground(view_, light_, transmittance_);
        return;
      case Mode::first_hit:
      case Mode::iso:
        if (part.shows_point && !pixel_.shows_point) pixel_ = part;
        return;
      case Mode::mip:
        if (part.shows_point && !(pixel_.value >= part.value)) pixel_ = part;
        return;
      case Mode::mean:
        return addMean(volume, part);
      case Mode::blocks:
      case Mode::minip:  // of one level always
      case Mode::attenuated_mip:
        return;
    }
  }

 private:
  void addMean(const DenseVolume& volume, const Pixel& part) {
    if (!(part.visible_length > 0)) return;
    const Classifier classifier(volume, view_);
    const double density = classifier.storedOf(part.value);
    length_ += part.visible_length;
    sum_ += part.visible_length * glm::dvec4(density * glm::dvec3(part.color), density);
    pixel_.value = classifier.dataOf(sum_.w / length_);
    pixel_.color = overBackground(view_, classifier.materialAt(sum_ / length_).color, 0);
  }

  const View& view_;
  Pixel& pixel_;
  double transmittance_ = 1;
  glm::dvec3 light_{0};
  double length_ = 0;
  glm::dvec4 sum_{0};
};

}  // namespace

Image renderLevels(std::span<const DenseVolume> levels, const View& resolved) {
  View clear = resolved;
  if (resolved.mode == Mode::blend) clear.background = {0, 0, 0, 0};
  return renderEach(resolved, [&](int x, int y) {
    const Ray ray = worldRay(resolved, x, y);
    const double along = glm::dot(ray.direction, glm::normalize(*resolved.target - *resolved.eye));
    Pixel pixel;
    pixel.color = overBackground(resolved, glm::dvec3(0), 1);
    Parts parts(resolved, pixel);
    for (std::size_t i = 0; i < levels.size(); ++i) {
      const Interval within{.t_min = i == 0 ? 0 : depthOf(levels[i], resolved) / along,
                            .t_max = i + 1 < levels.size() ? depthOf(levels[i + 1], resolved) / along : kInfinity};
      parts.add(levels[i], renderPixel(levels[i], clear, x, y, kPixelCentre, within));
    }
    return pixel;
  });
}

}  // namespace blockwalk::reference
