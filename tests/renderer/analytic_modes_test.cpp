// SPDX-License-Identifier: Apache-2.0
// The reference's modes and its margins against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/reference/converged.h"
#include "tests/reference/field.h"
#include "tests/reference/ray.h"
#include "tests/renderer/closed_forms.h"

namespace blockwalk::reference {
namespace {

DenseVolume randomColors(glm::ivec3 dims, std::uint32_t seed) {
  DenseVolume volume = emptyVolume(VoxelType::rgba8, dims);
  std::mt19937 random(seed);
  for (std::size_t i = 0; i < volume.density.size(); ++i) {
    volume.density[i] = random() % 3 == 0 ? 0.0f : static_cast<float>(random() % 256);
    for (std::uint8_t& channel : volume.color[i]) channel = static_cast<std::uint8_t>(random());
  }
  return volume;
}

TEST(AnalyticField, EmptyVoxelsHaveTheEmptyValue) {
  DenseVolume volume = emptyVolume(VoxelType::u16, {3, 1, 1});
  volume.empty_threshold = 40;
  volume.density = {39, 200, std::numeric_limits<float>::infinity()};
  const auto fieldAtX = [&](double x) { return fieldAt(volume, {x, 0.5, 0.5}).w; };
  EXPECT_EQ(emptyValue(volume), 0);
  EXPECT_EQ(fieldAtX(0.5), 0);
  EXPECT_EQ(fieldAtX(1), 100);
  EXPECT_EQ(fieldAtX(1.75), 150);
  volume.value_offset = -10;  // data value 0 is stored as 20, which is empty too
  volume.value_scale = 0.5;
  EXPECT_EQ(emptyValue(volume), 20);
  EXPECT_EQ(fieldAtX(1), 110);
  volume.value_offset = -100;  // ... as 200, which is not: the threshold then
  EXPECT_EQ(emptyValue(volume), 40);
  volume.value_offset = 100;  // ... as -200, which no u16 holds
  EXPECT_EQ(emptyValue(volume), 0);
  volume.type = VoxelType::f32;
  EXPECT_EQ(emptyValue(volume), -200);
  volume.empty_threshold = -300;
  EXPECT_EQ(emptyValue(volume), -300);
  volume.type = VoxelType::rgba8;
  EXPECT_EQ(emptyValue(volume), 0);
}

TEST(AnalyticField, EndsThatExcludeNothingHideNoInterpolatedValue) {
  DenseVolume volume = oneVoxel(VoxelType::u8, glm::ivec3(7), glm::ivec3(3), {0, 0, 0, 200});
  volume.level0_extent = Extent{.min = 200, .max = 200};
  View view = linearView({3.5, 3.5, 20}, {3.5, 3.5, 3});
  view.channels[0].transfer = transferRamp(0, 0.5, 200, 0.5);
  const auto length = [&](double lo, double hi) {
    view.channels[0].range = DensityRange{.lo = lo, .hi = hi};
    return std::log2(1 / (1 - renderPixelConverged(volume, view, 0, 0).color.a));
  };
  EXPECT_NEAR(length(200, 200), 2, 1e-9) << "the whole hat";
  EXPECT_NEAR(length(-5, 300), 2, 1e-9);
  volume.level0_extent = Extent{.min = 199, .max = 200};
  EXPECT_NEAR(length(199.5, 250), 2 * 0.5 / 200, 1e-9) << "its tip alone";
  EXPECT_NEAR(length(50, 150), 2 * 0.75, 1e-9) << "the hat without its tip";
  volume.level0_extent = Extent{.min = 20, .max = 200};
  EXPECT_NEAR(length(50, 150), 2 * 0.5, 1e-9);
}

TEST(AnalyticColor, RedBesideEmptyIsNeverDark) {
  const DenseVolume volume = oneVoxel(VoxelType::rgba8, glm::ivec3(7), glm::ivec3(3), {255, 0, 51, 90});
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(2.6, 4.4);
  for (Mode mode : {Mode::blend, Mode::first_hit, Mode::mip, Mode::mean}) {
    for (int i = 0; i < 50; ++i) {
      const glm::dvec3 through(uniform(random), uniform(random), uniform(random));
      const View view = linearView({-10, 13, 20}, through, mode);
      ASSERT_GT(pixelOf(volume, view).color.a, 0);
      EXPECT_LT(distance(colorOf(volume, view), {1, 0, 0.2}), 1e-9) << static_cast<int>(mode);
    }
  }
}

TEST(AnalyticColor, MixesByDensity) {
  DenseVolume volume = emptyVolume(VoxelType::rgba8, {2, 1, 1});
  volume.density = {60, 180};
  volume.color = {{{255, 0, 0}, {0, 0, 255}}};
  EXPECT_LT(distance(colorOf(volume, linearView({1, 0.5, 9}, {1, 0.5, 0}, Mode::mip)), {0.25, 0, 0.75}), kTolerance);
  volume.density = {60, 60};
  const double a = 0.3;  // of the way from red to blue
  EXPECT_LT(distance(colorOf(volume, linearView({0.5 + a, 0.5, 9}, {0.5 + a, 0.5, 0})), {1 - a, 0, a}), kTolerance);
}

TEST(AnalyticMip, IsTheLargestSample) {
  const DenseVolume hat = oneVoxel(VoxelType::rgba8, glm::ivec3(8), glm::ivec3(3), {255, 0, 0, 200});
  // Samples at z = 3.25 and 3.75 are a quarter of a voxel from the centre at 3.5; the nearer is shown.
  Pixel pixel = pixelOf(hat, alongZ(3.5, 3.5, Mode::mip));
  EXPECT_NEAR(pixel.value, 150, kTolerance);
  EXPECT_NEAR(pixel.t, 24 - 3.75, kTolerance);
  EXPECT_EQ(pixel.voxel, glm::ivec3(3));
  EXPECT_EQ(pixel.color, glm::dvec4(1, 0, 0, 1));
  View view = alongZ(3.5, 3.5, Mode::mip);
  view.channels[0].range = DensityRange{.lo = 0, .hi = 100};
  EXPECT_NEAR(pixelOf(hat, view).value, 50, kTolerance) << "the largest visible one";
  view.channels[0].range = DensityRange{.lo = 160, .hi = 300};
  EXPECT_EQ(pixelOf(hat, view).color.a, 0);
  EXPECT_TRUE(std::isnan(pixelOf(hat, view).value));
  view.filter = Filter::nearest;
  pixel = pixelOf(hat, view);
  EXPECT_EQ(pixel.value, 200);
  EXPECT_NEAR(pixel.t, 20, kTolerance);
  // A scalar is shown in the transfer function's colour, whatever its opacity.
  view = linearView({3.1, 4.2, 30}, {3.4, 3.9, 0}, Mode::mip);
  view.channels[0].transfer = transferRamp(0, 0, 10, 0);
  EXPECT_LT(distance(colorOf(ramp8(), view), {0.25, 0, 0.75}), kTolerance) << "7.5 at the edge";
  view.filter = Filter::nearest;
  EXPECT_LT(distance(colorOf(ramp8(), view), {0.25, 0, 0.75}), kTolerance);
}

TEST(AnalyticMip, OfEqualOnesIsTheFirst) {
  DenseVolume volume = emptyVolume(VoxelType::rgba8, glm::ivec3(8));
  volume.density[volume.at({3, 3, 6})] = volume.density[volume.at({3, 3, 1})] = 80;
  volume.color[volume.at({3, 3, 6})] = {0, 255, 0};
  volume.color[volume.at({3, 3, 1})] = {0, 0, 255};
  for (Filter filter : {Filter::nearest, Filter::linear}) {
    View view = alongZ(3.5, 3.5, Mode::mip);
    view.filter = filter;
    EXPECT_EQ(pixelOf(volume, view).color, glm::dvec4(0, 1, 0, 1));
    EXPECT_EQ(pixelOf(volume, view).rival_difference, filter == Filter::linear ? 1 : 0);
    volume.density[volume.at({3, 3, 1})] = 81;
    EXPECT_EQ(pixelOf(volume, view).color, glm::dvec4(0, 0, 1, 1));
    EXPECT_EQ(pixelOf(volume, view).rival_difference, 0);
    volume.density[volume.at({3, 3, 1})] = 80;
  }
}

TEST(AnalyticMean, IsOverTheVisibleLength) {
  const DenseVolume hat = oneVoxel(VoxelType::rgba8, glm::ivec3(8), glm::ivec3(3), {255, 0, 0, 200});
  View view = alongZ(3.5, 3.5, Mode::mean);
  EXPECT_NEAR(pixelOf(hat, view).value, 200 * (0.25 + 0.75) / 2, kTolerance);
  EXPECT_EQ(pixelOf(hat, view).color, glm::dvec4(1, 0, 0, 1));
  view.step = 1.0 / 128;
  EXPECT_NEAR(pixelOf(hat, view).value, 100, kTolerance);
  view.filter = Filter::nearest;
  EXPECT_NEAR(pixelOf(hat, view).value, 200, kTolerance);
  // Exact on a ramp, for any step.
  view = linearView({3.1, 4.2, 30}, {3.4, 3.9, 0}, Mode::mean);
  view.channels[0].transfer = transferRamp(0, 0, 10, 0);
  view.clip = ClipBox{.min = {-100, -100, 2.6}, .max = {100, 100, 5.2}};
  for (double step : {0.1, 0.7, 2.5}) {
    view.step = step;
    EXPECT_NEAR(pixelOf(ramp8(), view).value, 3.9, kTolerance) << step;
    EXPECT_LT(distance(colorOf(ramp8(), view), {0.61, 0, 0.39}), kTolerance);
  }
  view.filter = Filter::nearest;  // 0.4 of 2.5, all of 3.5 and 4.5, 0.2 of 5.5
  EXPECT_NEAR(pixelOf(ramp8(), view).value, (0.4 * 2.5 + 3.5 + 4.5 + 0.2 * 5.5) / 2.6, kTolerance);
  view.channels[0].range = DensityRange{.lo = 3, .hi = 5};
  EXPECT_NEAR(pixelOf(ramp8(), view).value, 4, kTolerance);
  view.channels[0].range = DensityRange{.lo = 30, .hi = 50};
  EXPECT_EQ(pixelOf(ramp8(), view).color, glm::dvec4(0));
}

TEST(AnalyticMean, WeightsColourByDensity) {
  DenseVolume volume = emptyVolume(VoxelType::rgba8, {1, 1, 2});
  volume.density = {60, 180};
  volume.color = {{{255, 0, 0}, {0, 0, 255}}};
  for (Filter filter : {Filter::nearest, Filter::linear}) {
    View view = linearView({0.5, 0.5, 9}, {0.5, 0.5, 0}, Mode::mean);
    view.filter = filter;
    EXPECT_LT(distance(colorOf(volume, view), {0.25, 0, 0.75}), kTolerance);
    EXPECT_NEAR(pixelOf(volume, view).value, 120, kTolerance);
  }
}

// Along a row of voxel centres the squared radius is straight between the centres.
TEST(AnalyticFirstHit, CrossesASphereWhereItsInterpolationDoes) {
  const Analytic sphere{.value = [](glm::dvec3 p) { return -glm::dot(p - 8.5, p - 8.5); }, .gradient = nullptr};
  const DenseVolume volume = sampled(sphere, VoxelType::f32, glm::ivec3(17));
  for (double radius : {1.3, 3.7, 6.2}) {
    const double centres = std::floor(radius);  // between squares of whole numbers
    const double expected = centres + (radius * radius - centres * centres) / (2 * centres + 1);
    View view = linearView({8.5, 8.5, 40}, {8.5, 8.5, 0}, Mode::iso);
    view.channels[0].transfer = transferRamp(-400, 1, 0, 1);
    view.iso = -radius * radius;
    EXPECT_NEAR(pixelOf(volume, view).t, 31.5 - expected, 1e-9) << radius;
    EXPECT_NEAR(pixelOf(volume, view).slope, 2 * centres + 1, 1e-9);
    // Seen from within, the far side is where the range ends.
    view.eye = glm::dvec3(8.5);
    view.mode = Mode::first_hit;
    view.channels[0].range = DensityRange{.lo = -1e9, .hi = -radius * radius};
    EXPECT_NEAR(pixelOf(volume, view).t, expected, 1e-9) << radius;
  }
}

TEST(AnalyticFirstHit, IsoIsCappedWhereTheRayEnters) {
  const DenseVolume volume = ramp8();
  View view = linearView({3.1, 4.2, 30}, {3.1, 4.2, 0}, Mode::iso);
  view.channels[0].transfer = transferRamp(0, 0, 10, 0);
  view.iso = 2;
  Pixel pixel = pixelOf(volume, view);
  EXPECT_TRUE(pixel.at_entry);
  EXPECT_NEAR(pixel.t, 22, kTolerance);
  EXPECT_NEAR(pixel.value, 7.5, kTolerance);
  view.clip = ClipBox{.min = {-100, -100, 0}, .max = {100, 100, 4.125}};
  EXPECT_NEAR(pixelOf(volume, view).t, 30 - 4.125, kTolerance);
  EXPECT_NEAR(pixelOf(volume, view).value, 4.125, kTolerance);
  view.iso.reset();  // the middle of the range
  view.clip.reset();
  view.channels[0].range = DensityRange{.lo = 1, .hi = 6};
  std::swap(view.eye->z, view.target->z);
  view.eye->z = -5;
  EXPECT_NEAR(pixelOf(volume, view).t, 8.5, 1e-9);
  view.filter = Filter::nearest;
  EXPECT_EQ(pixelOf(volume, view).voxel.z, 3) << "whose 3.5 is at least 3.5";
  view.iso = 3.6;
  EXPECT_EQ(pixelOf(volume, view).voxel.z, 4);
  view.iso = 9;
  EXPECT_EQ(pixelOf(volume, view).voxel, glm::ivec3(-1));
  EXPECT_EQ(pixelOf(volume, view).color.a, 0);
}

TEST(AnalyticFirstHit, NeedsOpacity) {
  View view = linearView({3.1, 4.2, 30}, {3.1, 4.2, 0}, Mode::first_hit);
  view.channels[0].transfer = {{.value = 4, .color = {1, 1, 1}, .opacity = 0.5},
                               {.value = 5, .color = {1, 1, 1}, .opacity = 0}};
  EXPECT_NEAR(pixelOf(ramp8(), view).t, 25, 1e-9);
  view.transfer_shape = TransferShape::stepped;
  EXPECT_NEAR(pixelOf(ramp8(), view).t, 25, 1e-9);
  view.channels[0].transfer[0].opacity = 0;
  EXPECT_EQ(pixelOf(ramp8(), view).voxel.x, -1);
}

// One world ramp held by three grids: along the axes, with other spacing, and with axes askew.
class SameWorld : public ::testing::Test {
 protected:
  // value = 20 + slope . p at the world positions of the voxel centres
  static DenseVolume worldRamp(glm::ivec3 dims, const glm::dmat4& map) {
    const auto world = [=](glm::dvec3 p) { return glm::dvec3(map * glm::dvec4(p, 1)); };
    const Analytic field{.value = [=](glm::dvec3 p) { return 20 + glm::dot(kSlope, world(p)); }, .gradient = nullptr};
    DenseVolume volume = sampled(field, VoxelType::f32, dims);
    volume.world_from_index = map;
    return volume;
  }
  static View view(Mode mode) {
    View result = linearView({14, 11, 19}, {4.2, 3.9, 4.1}, mode);
    result.width = result.height = 8;
    result.fov_degrees = 12;
    result.channels[0].transfer = transferRamp(10, 0.02, 40, 0.3);
    result.clip = ClipBox{.min = glm::dvec3(2), .max = glm::dvec3(6)};
    result.channels[0].range = DensityRange{.lo = 17, .hi = 26};
    result.iso = 24;
    return result;
  }
  // Dyadic: no voxel is rounded.
  static constexpr glm::dvec3 kSlope{0.5, 1.25, -0.75};
};

TEST_F(SameWorld, LooksTheSameThroughEveryMap) {
  const DenseVolume plain = worldRamp(glm::ivec3(8), glm::dmat4(1));
  const DenseVolume flat = worldRamp({8, 8, 4}, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1});
  const DenseVolume mirrored = worldRamp({8, 4, 8}, {0, 0, -1, 0, 2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 8, 1});
  const DenseVolume askew = worldRamp({16, 16, 16}, {1, 0, 0, 0, 0.5, 2, 0, 0, 0, 1, 1, 0, -6, -16, -4, 1});
  for (const DenseVolume* other : {&flat, &mirrored, &askew}) {
    for (bool lit : {false, true}) {
      View blend = view(Mode::blend);
      blend.lit = lit;
      for (int i = 0; i < 64; ++i) {
        const glm::dvec4 a = renderPixelConverged(plain, blend, i % 8, i / 8).color;
        const glm::dvec4 b = renderPixelConverged(*other, blend, i % 8, i / 8).color;
        EXPECT_LT(glm::length(a - b), 1e-10) << i;
        for (Mode mode : {Mode::first_hit, Mode::iso}) {
          View surface = view(mode);
          surface.lit = lit;
          const Pixel p = renderPixel(plain, surface, i % 8, i / 8), q = renderPixel(*other, surface, i % 8, i / 8);
          EXPECT_NEAR(p.t, q.t, 1e-9) << i;
          EXPECT_LT(glm::length(p.color - q.color), 1e-9) << i;
        }
      }
    }
  }
}

// The same voxels, world and camera turned together: sample for sample the same picture, in every mode.
TEST_F(SameWorld, TurnedWholeStaysTheSame) {
  const DenseVolume volume = randomColors({7, 6, 8}, 3);
  const double c = std::cos(0.7), s = std::sin(0.7), scale = 3;
  const glm::dmat3 rotation(c, s, 0, -s, c, 0, 0, 0, 1);
  const auto moved = [&](glm::dvec3 p) { return scale * (rotation * p) + glm::dvec3(-100, 20, 7); };
  DenseVolume turned = volume;
  turned.world_from_index = glm::dmat4(glm::dmat3(scale * rotation));
  turned.world_from_index[3] = glm::dvec4(moved({0, 0, 0}), 1);
  for (Mode mode : {Mode::blend, Mode::first_hit, Mode::iso, Mode::mip, Mode::mean}) {
    View view = linearView({31, 17, 23}, {3.1, 2.9, 4.2}, mode);
    view.width = view.height = 12;
    view.fov_degrees = 25;
    view.lit = true;
    view.iso = 120;
    View turned_view = view;
    turned_view.eye = moved(*view.eye);
    turned_view.target = moved(*view.target);
    turned_view.up = rotation * *view.up;
    // The bounding sphere of the turned box is larger, the eye outside both: the lattice is the same.
    const Image a = renderImage(volume, view), b = renderImage(turned, turned_view);
    double largest = 0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) {
      largest = std::max(largest, glm::length(a.pixels[i].color - b.pixels[i].color));
      if (std::isfinite(a.pixels[i].margin)) {
        EXPECT_NEAR(a.pixels[i].margin, b.pixels[i].margin, 1e-9);
      } else {
        EXPECT_EQ(a.pixels[i].margin, b.pixels[i].margin);
      }
    }
    EXPECT_LT(largest, 1e-8) << static_cast<int>(mode);
  }
}

TEST(AnalyticMargins, TellHowNearARoundingIs) {
  const DenseVolume volume = ramp8();
  View view = alongZ(3.5, 3.5, Mode::first_hit);  // samples at 7.75, 7.25, 6.75, ...
  view.channels[0].transfer = transferRamp(0, 0.5, 10, 0.5);
  view.channels[0].range = DensityRange{.lo = -1e30, .hi = 6.8};
  EXPECT_NEAR(pixelOf(volume, view).margin, 0.05, kTolerance);
  EXPECT_NEAR(pixelOf(volume, view).t, 24 - 6.8, 1e-9);
  EXPECT_NEAR(pixelOf(volume, view).slope, -1, 1e-9);
  view.channels[0].range->hi = 5.6;  // the hit's sample at 5.25, the one before at 5.75
  EXPECT_NEAR(pixelOf(volume, view).margin, 0.15, kTolerance);
  view.channels[0].range->lo = 3.25;  // a sample at that, but behind the hit
  EXPECT_NEAR(pixelOf(volume, view).margin, 0.15, kTolerance);
  view.mode = Mode::blend;
  EXPECT_NEAR(pixelOf(volume, view).margin, 0, kTolerance);
  view.channels[0].range = DensityRange{.lo = -1e30, .hi = 1e30};
  EXPECT_NEAR(pixelOf(volume, view).margin, 1.25, kTolerance)
      << "0.75 from the threshold at -0.5; the sample at 0.25 is among equal voxels";
  EXPECT_NEAR(pixelOf(volume, view).lattice_distance, 0, kTolerance);
  view.clip = ClipBox{.min = {-100, -100, 1.9}, .max = {100, 100, 6.15}};
  EXPECT_NEAR(pixelOf(volume, view).lattice_distance, 0.2, kTolerance);
  view.transfer_shape = TransferShape::stepped;
  view.channels[0].transfer = {{.value = 0, .color = {}, .opacity = 0.5}, {.value = 4.5, .color = {}, .opacity = 0.6}};
  EXPECT_NEAR(pixelOf(volume, view).margin, 0.25, kTolerance);
  view.mode = Mode::mip;  // only the largest is coloured: in the middle of the cut interval from 4.5
  view.clip = ClipBox{.min = {-100, -100, 1.9}, .max = {100, 100, 4.95}};
  EXPECT_NEAR(pixelOf(volume, view).margin, 0.225, kTolerance);
  // Among equal voxels nothing is near.
  view = linearView({4, 4, 30}, {4, 4, 0});
  view.channels[0].range = DensityRange{.lo = 77, .hi = 77};
  view.channels[0].transfer = transferRamp(0, 0.5, 100, 0.5);
  EXPECT_EQ(pixelOf(sampled(constantField(77), VoxelType::u8, glm::ivec3(8)), view).margin,
            std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace blockwalk::reference
