// SPDX-License-Identifier: Apache-2.0
// The modes of the reference renderer, one function a filter: what each makes of the field along a pixel's ray
// (docs/integration.md, Modes). They fill in what reference.h says of the pixel.
#pragma once

#include <functional>
#include <span>

#include "tests/reference/cut_ray.h"
#include "tests/reference/reference.h"

namespace blockwalk::reference {

struct Scene {
  const DenseVolume& volume;
  const View& view;
};

// nearest_modes.cpp: exact path lengths in voxels
void nearestBlend(const Scene& scene, const CutRay& cut, Pixel& pixel);
void nearestFirstHit(const Scene& scene, const CutRay& cut, Pixel& pixel);  // and iso
void nearestMip(const Scene& scene, const CutRay& cut, Pixel& pixel);
void nearestMinip(const Scene& scene, const CutRay& cut, Pixel& pixel);
void nearestAttenuatedMip(const Scene& scene, const CutRay& cut, Pixel& pixel);
void nearestMean(const Scene& scene, const CutRay& cut, Pixel& pixel);
void countBlocks(std::span<const DenseVolume> channels, const View& view, const CutRay& cut, Pixel& pixel);

// linear_modes.cpp: samples on the lattice
void linearBlend(const Scene& scene, const CutRay& cut, Pixel& pixel);
void linearFirstHit(const Scene& scene, const CutRay& cut, Pixel& pixel);  // and iso
void linearMip(const Scene& scene, const CutRay& cut, Pixel& pixel);
void linearMinip(const Scene& scene, const CutRay& cut, Pixel& pixel);
void linearAttenuatedMip(const Scene& scene, const CutRay& cut, Pixel& pixel);
void linearMean(const Scene& scene, const CutRay& cut, Pixel& pixel);

// What the view's mode and filter make of it.
void renderAlong(const Scene& scene, const CutRay& cut, Pixel& pixel);

// The pixels of a view's size, on every core.
Image renderEach(const View& view, const std::function<Pixel(int x, int y)>& render);

// Finds where on its way a ray has gathered an opacity of a half: pieces of constant extinction (per world unit) in
// order.
class HalfOpacity {
 public:
  // `value`: of the piece, data units.
  void add(double extinction, Interval piece, double value);
  void show(Pixel& pixel) const;

 private:
  double depth_ = 0;
  std::array<double, 3> t_{kNever, kNever, kNever};  // early, at a half, late
  std::array<double, 3> value_{};                    // there
  static constexpr double kNever = std::numeric_limits<double>::infinity();
};

double unitDistanceOf(const DenseVolume& volume);

// Straight colour of `premultiplied` light seen with `transmittance` left, over the view's background; cut to 1, which
// lit colours may exceed.
glm::dvec4 overBackground(const View& view, glm::dvec3 premultiplied, double transmittance);

}  // namespace blockwalk::reference
