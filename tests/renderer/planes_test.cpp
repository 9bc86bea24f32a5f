// SPDX-License-Identifier: Apache-2.0
// Clip planes: the reference against closed forms, and every finder, walk and cull against the reference.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/reference/analytic.h"
#include "tests/renderer/compare.h"
#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"
#include "tests/renderer/views.h"

namespace blockwalk::test {
namespace {

glm::dvec3 randomDirection(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const double x = normal(random), y = normal(random), z = normal(random);
  return glm::normalize(glm::dvec3(x, y, z));
}

class PlanesTest : public RendererTest {
 protected:
  // Views from everywhere, each cut by one to six planes of any length that leave a neighbourhood of one point.
  static std::vector<View> views(const Scene& scene, const reference::DenseVolume& dense) {
    std::mt19937 random(31);
    std::uniform_real_distribution<double> share(0, 1);
    const WorldBox box = worldBox(scene.info);
    const double radius = glm::length(box.max - box.min) / 2;
    std::vector<View> list;
    for (View view : randomViews(scene.info, dense, 32)) {
      const double x = share(random), y = share(random), z = share(random);
      const glm::dvec3 index = glm::dvec3(scene.info.dims) * (0.25 + 0.5 * glm::dvec3(x, y, z));
      const glm::dvec3 kept(scene.info.world_from_index * glm::dvec4(index, 1));
      const std::size_t count = 1 + list.size() % 6;
      for (std::size_t i = 0; i < count; ++i) {
        const double length = std::pow(10.0, 6 * share(random) - 3);
        const glm::dvec3 normal = length * randomDirection(random);
        view.planes.push_back({normal, length * 0.3 * share(random) * radius - glm::dot(normal, kept)});
      }
      list.push_back(view);
    }
    return list;
  }

  // The same as a clip box, as planes that are not normalised.
  static std::vector<ClipPlane> planesOf(const ClipBox& box) {
    std::vector<ClipPlane> planes;
    for (int axis = 0; axis < 3; ++axis) {
      glm::dvec3 normal(0);
      normal[axis] = 1 + axis;
      planes.push_back({normal, -normal[axis] * box.min[axis]});
      planes.push_back({-normal, normal[axis] * box.max[axis]});
    }
    return planes;
  }
};

TEST(Planes, CutTheReferencesRaysWhereTheFormulaSays) {
  using namespace reference;
  DenseVolume volume = sampled(constantField(80), VoxelType::u8, glm::ivec3(12));
  volume.type = VoxelType::rgba8;
  volume.color.assign(volume.density.size(), {255, 128, 0});
  const auto lengthSeen = [&](std::vector<ClipPlane> planes) {
    View view = linearView({3.3, 4.4, 30}, {3.3, 4.4, 0});
    view.planes = std::move(planes);
    view.background = {0, 0, 0, 0};
    double seen = 0;
    for (Filter filter : {Filter::nearest, Filter::linear}) {
      view.filter = filter;
      const double length = -std::log1p(-renderPixel(volume, view, 0, 0).color.a) / (0.3 * 80 / 255);
      if (filter == Filter::linear) {
        EXPECT_NEAR(length, seen, 1e-9);
      }
      seen = length;
    }
    return seen;
  };
  EXPECT_NEAR(lengthSeen({}), 12, 1e-9);
  EXPECT_NEAR(lengthSeen({{{0, 0, 1}, -5}}), 7, 1e-9);
  EXPECT_NEAR(lengthSeen({{{0, 0, -1e-3}, 5e-3}}), 5, 1e-9);
  // x + y + z >= 10 leaves z >= 2.3; x + 2 z <= 20.3 leaves z <= 8.5.
  EXPECT_NEAR(lengthSeen({{{1, 1, 1}, -10}, {{-1, 0, -2}, 20.3}}), 6.2, 1e-9);
  EXPECT_NEAR(lengthSeen({{{1, 0, 0}, -3.2}}), 12, 1e-9);
  EXPECT_EQ(lengthSeen({{{1, 0, 0}, -3.4}}), 0);
  EXPECT_EQ(lengthSeen({{{0, 0, 1}, -7}, {{0, 0, -1}, 6}}), 0);
}

TEST_F(PlanesTest, CutColoursAndHitsAsTheReference) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::rgba8, .dims = {70, 64, 57}}));
  const reference::DenseVolume dense = scene.dense(0);
  ImageError total;
  ProbeError hits;
  for (const View& view : views(scene, dense)) {
    const reference::Image expected = reference::renderImage(dense, view);
    View hit_view = view;
    hit_view.mode = Mode::first_hit;
    const reference::Image expected_hits = reference::renderImage(dense, hit_view);
    for (const Combination& combination : combinations()) {
      const std::string what = toString(combination) + ", view " + toString(view) + ": ";
      const ImageError error = compareToReference(draw(scene, with(view, combination)), expected, view.background);
      EXPECT_LE(error.largest, kLargestError) << what << error.worst;
      total.add(error);
      const ProbeError hit = compareHits(draw(scene, with(hit_view, combination)), expected_hits, 1);
      EXPECT_EQ(hit.unexcused, 0u) << what << hit.worst;
      hits.add(hit);
    }
  }
  EXPECT_GE(total.psnr(), 55);
  EXPECT_GT(total.drawn * 20, hits.pixels) << "too little to see";
  EXPECT_GT(hits.met * 20, hits.pixels) << "too little to hit";
}

TEST_F(PlanesTest, CapSurfacesOfTheFieldAsTheReference) {
  Scene scene = makeScene(
      *makeSynthetic({.type = VoxelType::u16, .dims = {61, 100, 49}, .seed = 3, .world_from_index = obliqueMap(true)}));
  const reference::DenseVolume dense = scene.dense(0);
  ImageError total;
  for (View view : views(scene, dense)) {
    view.mode = Mode::iso;
    view.filter = Filter::linear;
    const reference::Image expected = reference::renderImage(dense, view);
    for (const Combination& combination : combinations()) {
      const ImageError error = compareToReference(draw(scene, with(view, combination)), expected, view.background);
      EXPECT_LE(error.largest, kLargestError)
          << toString(combination) << ", view " << toString(view) << ": " << error.worst;
      total.add(error);
    }
  }
  EXPECT_GE(total.psnr(), 55);
  EXPECT_GT(total.drawn * 20, total.channels / 4) << "too little to see";
}

TEST_F(PlanesTest, SixOfThemAreABoxAndTogetherTheyAreTwelve) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::rgba8, .dims = {70, 64, 57}}));
  View plain;
  plain.width = 96;
  plain.height = 72;
  plain.level = 0;
  View boxed = plain, cut = plain, both = plain;
  boxed.clip = ClipBox{.min = {10, 12, 14}, .max = {51, 47, 33}};
  cut.planes = planesOf(*boxed.clip);
  both.clip = ClipBox{.min = {5, 12, 2}, .max = {51, 60, 33}};
  both.planes = planesOf({.min = {10, 3, 14}, .max = {60, 47, 50}});
  const Frame expected = draw(scene, boxed);
  EXPECT_GT(compareImages(expected, draw(scene, plain)).largest, 50);
  EXPECT_LE(compareImages(draw(scene, cut), expected).largest, 1);
  EXPECT_LE(compareImages(draw(scene, both), expected).largest, 1);
}

// Numbers at the ends of what a double holds, and planes that the eye lies in, give what they say.
TEST_F(PlanesTest, ExtremePlanesAreFinite) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::rgba8, .dims = {70, 64, 57}}));
  View view;
  view.width = 96;
  view.height = 72;
  view.level = 0;
  const Frame all = draw(scene, view);
  view.planes = {{{0, 1e-310, 0}, -30e-310}};
  const Frame half = draw(scene, view);
  EXPECT_GT(compareImages(half, all).largest, 50);
  view.planes = {{{0, 1e300, 0}, -30e300}};
  EXPECT_LE(compareImages(draw(scene, view), half).largest, 1);
  view.planes = {{{0, 1e-310, 0}, 1e300}, {{1e-300, 1e300, 0}, 1e301}};
  EXPECT_EQ(draw(scene, view).pixels, all.pixels);
  view.planes = {{{1e-310, 0, 1e-310}, -1e300}};
  EXPECT_EQ(compareImages(draw(scene, view), all).drawn, 0u);
  EXPECT_EQ(draw(scene, view).pixels, std::vector<std::uint32_t>(all.pixels.size(), 0xff000000u));
  // The eye in the plane, which the view's middle ray stays in.
  view = spellOut(resolveView(view, scene.info));
  view.width = 97;
  const glm::dvec3 forward = glm::normalize(*view.target - *view.eye);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, *view.up));
  view.planes = {{right, -glm::dot(right, *view.eye)}};
  const reference::Image expected = reference::renderImage(scene.dense(0), view);
  const Frame frame = draw(scene, view);
  for (std::size_t i = 0; i < frame.pixels.size(); ++i) {
    if (i % 97 == 48) continue;
    const std::array<std::uint8_t, 4> color = reference::roundColor(expected.pixels[i].color);
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(static_cast<int>(frame.pixels[i] >> (8 * c) & 0xff), static_cast<int>(color[c]), 2) << i;
    }
  }
}

}  // namespace
}  // namespace blockwalk::test
