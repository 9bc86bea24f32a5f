// SPDX-License-Identifier: Apache-2.0
// The reference itself against closed forms and against brute force.
#include "tests/reference/reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/reference/ray.h"

namespace blockwalk::reference {
namespace {

constexpr double kTolerance = 1e-12;

View viewOf(glm::dvec3 eye, glm::dvec3 target, glm::dvec3 up) {
  View view;
  view.width = 1;
  view.height = 1;
  view.eye = eye;
  view.target = target;
  view.up = up;
  view.channels[0].range = DensityRange{.lo = 0, .hi = 255};
  view.extinction = 0.3;
  return view;
}

void setVoxel(DenseVolume& volume, glm::ivec3 voxel, std::array<std::uint8_t, 4> rgba) {
  const std::size_t at = volume.at(voxel);
  volume.density[at] = static_cast<float>(rgba[3]);
  if (volume.type == VoxelType::rgba8) volume.color[at] = {rgba[0], rgba[1], rgba[2]};
}

template <typename Function>  // Function(voxel) -> rgba
void fill(DenseVolume& volume, Function function) {
  for (int z = 0; z < volume.dims.z; ++z) {
    for (int y = 0; y < volume.dims.y; ++y) {
      for (int x = 0; x < volume.dims.x; ++x) setVoxel(volume, {x, y, z}, function(glm::ivec3(x, y, z)));
    }
  }
}

DenseVolume randomVolume(glm::ivec3 dims, std::uint32_t seed) {
  DenseVolume volume = emptyVolume(VoxelType::rgba8, dims);
  std::mt19937 random(seed);
  fill(volume, [&](glm::ivec3) {
    const std::uint32_t bits = random();
    const bool empty = (random() & 3) != 0;
    return std::array<std::uint8_t, 4>{static_cast<std::uint8_t>(bits), static_cast<std::uint8_t>(bits >> 8),
                                       static_cast<std::uint8_t>(bits >> 16),
                                       empty ? std::uint8_t{0} : static_cast<std::uint8_t>(bits >> 24)};
  });
  return volume;
}

double opacityOf(const DenseVolume& volume, const View& view) {
  View transparent = view;
  transparent.background = {0, 0, 0, 0};
  return renderPixel(volume, transparent, 0, 0).color.a;
}

glm::dvec3 randomPoint(std::mt19937& random, double lo, double hi) {
  std::uniform_real_distribution<double> value(lo, hi);
  const double x = value(random), y = value(random), z = value(random);
  return {x, y, z};
}

double largestDifference(const Image& a, const Image& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    const glm::dvec4 difference = glm::abs(a.pixels[i].color - b.pixels[i].color);
    largest = std::max({largest, difference.r, difference.g, difference.b, difference.a});
  }
  return largest;
}

TEST(Reference, SlabHasTheOpacityOfItsThickness) {
  DenseVolume volume = emptyVolume(VoxelType::rgba8, {20, 20, 20});
  fill(volume, [](glm::ivec3 v) {
    return std::array<std::uint8_t, 4>{255, 0, 0, v.z >= 3 && v.z < 7 ? std::uint8_t{128} : std::uint8_t{0}};
  });
  const View straight = viewOf({10.3, 9.6, 50}, {10.3, 9.6, 0}, {0, 1, 0});
  EXPECT_NEAR(opacityOf(volume, straight), -std::expm1(-0.3 * 128 / 255 * 4), kTolerance);
  const glm::dvec3 eye(12, 14, 40), target(10.3, 9.6, 5);
  const double cosine = std::abs(glm::normalize(target - eye).z);
  EXPECT_NEAR(opacityOf(volume, viewOf(eye, target, {0, 1, 0})), -std::expm1(-0.3 * 128 / 255 * 4 / cosine),
              kTolerance);
  const View inside = viewOf({10.3, 9.6, 5.25}, {10.3, 9.6, 0}, {0, 1, 0});
  EXPECT_NEAR(opacityOf(volume, inside), -std::expm1(-0.3 * 128 / 255 * 2.25), kTolerance);
}

TEST(Reference, VoxelHasTheOpacityOfItsChord) {
  DenseVolume volume = emptyVolume(VoxelType::rgba8, {9, 9, 9});
  setVoxel(volume, {4, 4, 4}, {255, 255, 255, 255});
  const glm::dvec3 center(4.5, 4.5, 4.5);
  const auto opacity = [&](glm::dvec3 through, glm::dvec3 direction) {
    return opacityOf(volume, viewOf(through - 20.0 * direction, through, {0.3, 1, 0.2}));
  };
  EXPECT_NEAR(opacity(center, {1, 1, 1}), -std::expm1(-0.3 * std::numbers::sqrt3), kTolerance);
  EXPECT_NEAR(opacity(center, {0, 1, 1}), -std::expm1(-0.3 * std::numbers::sqrt2), kTolerance);
  // Shifted across the diagonal, the chord of a unit square shrinks by twice the shift.
  for (double shift : {0.1, 0.3, 0.6}) {
    const glm::dvec3 through = center + glm::dvec3(0, shift, -shift) / std::numbers::sqrt2;
    EXPECT_NEAR(opacity(through, {0, 1, 1}), -std::expm1(-0.3 * (std::numbers::sqrt2 - 2 * shift)), kTolerance);
  }
  EXPECT_EQ(opacity(center + glm::dvec3(0, 0.75, -0.75), {0, 1, 1}), 0);
}

TEST(Reference, CheckerboardDiagonalsSeeOneColourOnly) {
  DenseVolume volume = emptyVolume(VoxelType::rgba8, {16, 16, 1});
  fill(volume, [](glm::ivec3 v) {
    return std::array<std::uint8_t, 4>{255, 255, 255, (v.x + v.y) % 2 == 0 ? std::uint8_t{255} : std::uint8_t{0}};
  });
  // Exactly through the corners: cells touched in an edge have no length.
  const View even = viewOf({-4, -4, 0.5}, {4, 4, 0.5}, {0, 0, 1});
  EXPECT_NEAR(opacityOf(volume, even), -std::expm1(-0.3 * 16 * std::numbers::sqrt2), kTolerance);
  const View odd = viewOf({-3, -4, 0.5}, {5, 4, 0.5}, {0, 0, 1});
  EXPECT_EQ(opacityOf(volume, odd), 0);
  const View row = viewOf({-4, 3.5, 0.5}, {4, 3.5, 0.5}, {0, 0, 1});
  EXPECT_NEAR(opacityOf(volume, row), -std::expm1(-0.3 * 8), kTolerance);
}

TEST(Reference, SphereApproachesTheAnalyticIntegral) {
  constexpr int kSide = 160;
  constexpr double kRadius = 72;
  DenseVolume volume = emptyVolume(VoxelType::u8, glm::ivec3(kSide));
  fill(volume, [](glm::ivec3 v) {
    const double radius = glm::length(glm::dvec3(v) + 0.5 - kSide / 2.0);
    return std::array<std::uint8_t, 4>{0, 0, 0, radius < kRadius ? std::uint8_t{100} : std::uint8_t{0}};
  });
  View view = viewOf({300, 190, 240}, glm::dvec3(kSide / 2.0), {0, 1, 0});
  view.width = view.height = 64;
  view.fov_degrees = 22;
  view.background = {0, 0, 0, 0};
  view.channels[0].transfer = {{.value = 0, .color = {0, 0, 0}, .opacity = 0},
                               {.value = 200, .color = {1, 1, 1}, .opacity = 0.02}};
  const double sigma = -std::log1p(-0.01);
  const Image image = renderImage(volume, view);
  double sum = 0;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const Ray ray = worldRay(view, x, y);
      const double along = glm::dot(glm::dvec3(kSide / 2.0) - ray.origin, ray.direction);
      const double miss = glm::length(ray.at(along) - glm::dvec3(kSide / 2.0));
      const double chord = 2 * std::sqrt(std::max(0.0, kRadius * kRadius - miss * miss));
      const double opacity = image.pixels[static_cast<std::size_t>(y * 64 + x)].color.a;
      const double error = opacity - -std::expm1(-sigma * chord);
      // Voxels cut the surface off by less than their diagonal; a grazing ray feels it over a longer way.
      EXPECT_LT(std::abs(error), chord > kRadius ? 0.02 : 0.25) << x << ' ' << y;
      sum += error;
    }
  }
  EXPECT_LT(std::abs(sum / (64 * 64)), 0.001);
}

TEST(Reference, NearerVoxelCoversTheFarther) {
  DenseVolume volume = emptyVolume(VoxelType::rgba8, {3, 1, 1});
  setVoxel(volume, {0, 0, 0}, {255, 0, 0, 255});
  setVoxel(volume, {2, 0, 0}, {0, 0, 255, 51});
  View view = viewOf({-5, 0.5, 0.5}, {0, 0.5, 0.5}, {0, 1, 0});
  view.extinction = 2;
  view.background = {0, 255, 0, 255};
  const double red = -std::expm1(-2.0), blue = -std::expm1(-2.0 * 51 / 255);
  const glm::dvec4 front = renderPixel(volume, view, 0, 0).color;
  EXPECT_NEAR(front.r, red, kTolerance);
  EXPECT_NEAR(front.b, (1 - red) * blue, kTolerance);
  EXPECT_NEAR(front.g, (1 - red) * (1 - blue), kTolerance);
  EXPECT_NEAR(front.a, 1, kTolerance);
  view.eye = glm::dvec3(9, 0.5, 0.5);
  const glm::dvec4 back = renderPixel(volume, view, 0, 0).color;
  EXPECT_NEAR(back.b, blue, kTolerance);
  EXPECT_NEAR(back.r, (1 - blue) * red, kTolerance);
}

TEST(Reference, TranslucentBackgroundIsCompositedPremultiplied) {
  DenseVolume volume = emptyVolume(VoxelType::rgba8, {1, 1, 1});
  setVoxel(volume, {0, 0, 0}, {255, 0, 0, 255});
  View view = viewOf({0.5, 0.5, 5}, {0.5, 0.5, 0}, {0, 1, 0});
  view.extinction = std::numbers::ln2;
  view.background = {0, 0, 255, 51};
  const glm::dvec4 color = renderPixel(volume, view, 0, 0).color;
  EXPECT_NEAR(color.a, 0.5 + 0.5 * 0.2, kTolerance);
  EXPECT_NEAR(color.r * color.a, 0.5, kTolerance);
  EXPECT_NEAR(color.b * color.a, 0.5 * 0.2, kTolerance);
}

TEST(Reference, CameraHasRowZeroAtTheTopAndIsRightHanded) {
  View view = viewOf({0, 0, 10}, {0, 0, 0}, {0, 1, 0});
  view.width = 40;
  view.height = 20;
  view.fov_degrees = 90;
  const Ray top_left = worldRay(view, 0, 0);
  EXPECT_NEAR(top_left.direction.y / -top_left.direction.z, 0.95, kTolerance);
  EXPECT_NEAR(top_left.direction.x / -top_left.direction.z, -1.95, kTolerance);
  EXPECT_NEAR(glm::length(top_left.direction), 1, kTolerance);
  view.ortho_height = 10;
  const Ray bottom_right = worldRay(view, 39, 19);
  EXPECT_NEAR(bottom_right.origin.x, 9.75, kTolerance);
  EXPECT_NEAR(bottom_right.origin.y, -4.75, kTolerance);
  EXPECT_NEAR(bottom_right.direction.z, -1, kTolerance);
}

TEST(Reference, ImageDoesNotDependOnTheWorldFrame) {
  DenseVolume volume = randomVolume({12, 10, 8}, 1);
  volume.world_from_index[2][2] = 2.5;
  View view = viewOf({25, 18, 40}, {6, 5, 10}, {0, 1, 0});
  view.width = 24;
  view.height = 18;
  const Image image = renderImage(volume, view);
  // The world rotated, scaled alike along all axes and shifted, and the camera with it.
  const double c = std::cos(0.7), s = std::sin(0.7);
  const glm::dmat3 rotation(c, s, 0, -s, c, 0, 0, 0, 1);
  const double scale = 3;
  const glm::dvec3 shift(-100, 20, 7);
  const auto moved = [&](glm::dvec3 p) { return scale * (rotation * p) + shift; };
  glm::dmat4 frame(glm::dmat3(scale * rotation));
  frame[3] = glm::dvec4(shift, 1);
  DenseVolume other = volume;
  other.world_from_index = frame * volume.world_from_index;
  View other_view = view;
  other_view.eye = moved(*view.eye);
  other_view.target = moved(*view.target);
  other_view.up = rotation * *view.up;
  EXPECT_LT(largestDifference(image, renderImage(other, other_view)), 1e-9);
}

TEST(Reference, AnisotropicVoxelsEqualRepeatedOnes) {
  DenseVolume tall = randomVolume({9, 8, 7}, 2);
  tall.world_from_index[2][2] = 2;
  DenseVolume repeated = emptyVolume(VoxelType::rgba8, {9, 8, 14});
  fill(repeated, [&](glm::ivec3 v) {
    const std::size_t at = tall.at({v.x, v.y, v.z / 2});
    return std::array<std::uint8_t, 4>{tall.color[at][0], tall.color[at][1], tall.color[at][2],
                                       static_cast<std::uint8_t>(tall.density[at])};
  });
  View view = viewOf({20, 15, 33}, {4.5, 4, 7}, {0, 1, 0});
  view.width = view.height = 20;
  EXPECT_LT(largestDifference(renderImage(tall, view), renderImage(repeated, view)), 1e-9);
  view.ortho_height = 18;
  EXPECT_LT(largestDifference(renderImage(tall, view), renderImage(repeated, view)), 1e-9);
}

TEST(Reference, CoarserLevelFillsTheSameWorldBox) {
  DenseVolume volume = emptyVolume(VoxelType::rgba8, {3, 3, 3});
  fill(volume, [](glm::ivec3) { return std::array<std::uint8_t, 4>{255, 255, 255, 255}; });
  volume.level = 1;
  volume.level0_dims = glm::ivec3(5);
  const View view = viewOf({20, 2.2, 2.3}, {0, 2.2, 2.3}, {0, 1, 0});
  EXPECT_NEAR(opacityOf(volume, view), -std::expm1(-0.3 * 5), kTolerance);
  View first_hit = view;
  first_hit.mode = Mode::first_hit;
  const Pixel pixel = renderPixel(volume, first_hit, 0, 0);
  EXPECT_EQ(pixel.voxel, glm::ivec3(2, 1, 1));
  EXPECT_NEAR(pixel.t, 15, kTolerance);
}

TEST(Reference, RangeIsInclusiveInDataUnitsAndEmptyStaysEmpty) {
  DenseVolume volume = emptyVolume(VoxelType::u16, {6, 1, 1});
  volume.value_scale = 0.5;
  volume.value_offset = -10;
  volume.empty_threshold = 4;
  const float stored[] = {
      4, 10, 20, 30, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()};
  for (int i = 0; i < 6; ++i) volume.density[volume.at({i, 0, 0})] = stored[i];
  View view = viewOf({-3, 0.5, 0.5}, {0, 0.5, 0.5}, {0, 1, 0});
  view.channels[0].transfer = {{.value = -100, .color = {1, 1, 1}, .opacity = 0.5}};
  const auto visible = [&](double lo, double hi) {
    view.channels[0].range = DensityRange{.lo = lo, .hi = hi};
    return std::lround(-std::log2(1 - opacityOf(volume, view)));
  };
  EXPECT_EQ(visible(-1000, 1000), 3);
  EXPECT_EQ(visible(-5, 0), 2);
  EXPECT_EQ(visible(-4.999, -0.001), 0);
  EXPECT_EQ(visible(0, 0), 1);
  EXPECT_EQ(visible(-8, -8), 0);  // at the empty threshold
}

TEST(Reference, TransferIsLinearBetweenPointsAndConstantBeyond) {
  const std::vector<TransferPoint> transfer = {{.value = 10, .color = {0, 0, 1}, .opacity = 0.2},
                                               {.value = 30, .color = {1, 0, 0}, .opacity = 1}};
  EXPECT_EQ(transferAt(transfer, -5).opacity, 0.2);
  EXPECT_NEAR(transferAt(transfer, 15).opacity, 0.4, kTolerance);
  EXPECT_NEAR(transferAt(transfer, 15).color.r, 0.25, kTolerance);
  EXPECT_EQ(transferAt(transfer, 31).opacity, 1);
  DenseVolume volume = emptyVolume(VoxelType::u8, {1, 1, 1});
  volume.density[0] = 30;
  View view = viewOf({0.5, 0.5, 3}, {0.5, 0.5, 0}, {0, 1, 0});
  view.channels[0].transfer = transfer;
  EXPECT_EQ(renderPixel(volume, view, 0, 0).color, glm::dvec4(1, 0, 0, 1)) << "opacity 1 is opaque at once";
}

// What the walk along a ray finds, found by cutting the ray with every cell's own box.
TEST(Reference, WalkFindsWhatBruteForceFinds) {
  DenseVolume volume = randomVolume({13, 11, 9}, 3);
  volume.world_from_index = glm::dmat4(0.9, 0.1, 0, 0, -0.2, 1.3, 0, 0, 0, 0.4, -0.7, 0, 3, 4, 5, 1);
  deriveBlocks(volume, 4);
  std::mt19937 random(4);
  for (int i = 0; i < 300; ++i) {
    const glm::dvec3 inside = glm::dvec3(volume.world_from_index * glm::dvec4(randomPoint(random, 0, 9), 1));
    View view = viewOf(inside + randomPoint(random, -15, 15), inside, {0.01, 1, 0.02});
    view.channels[0].range = DensityRange{.lo = 40, .hi = 190};
    if (i % 3 == 0) view.clip = ClipBox{.min = inside - 2.0, .max = inside + randomPoint(random, 0.5, 3)};
    const Ray world = worldRay(view, 0, 0);
    const Ray ray = indexRay(volume, world);
    Interval whole{.t_min = 0, .t_max = 1e9};
    if (view.clip) whole = cutToBox(world, view.clip->min, view.clip->max, whole);
    whole = cutToBox(ray, glm::dvec3(0), glm::dvec3(volume.dims), whole);
    double optical_depth = 0, t_hit = 1e9;
    glm::ivec3 hit(-1);
    for (int v = 0; v < 13 * 11 * 9; ++v) {
      const glm::ivec3 voxel(v % 13, v / 13 % 11, v / (13 * 11));
      const float density = volume.density[volume.at(voxel)];
      const Interval piece = cutToBox(ray, glm::dvec3(voxel), glm::dvec3(voxel + 1), whole);
      if (!(piece.t_max - piece.t_min > 1e-13) || density < 40 || density > 190) continue;
      optical_depth += view.extinction * static_cast<double>(density) / 255 * (piece.t_max - piece.t_min);
      if (piece.t_min >= t_hit) continue;
      t_hit = piece.t_min;
      hit = voxel;
    }
    optical_depth /= glm::length(glm::dvec3(0, 0.4, -0.7));
    EXPECT_NEAR(opacityOf(volume, view), -std::expm1(-optical_depth), 1e-10) << i;
    view.mode = Mode::first_hit;
    EXPECT_EQ(renderPixel(volume, view, 0, 0).voxel, hit) << i;
    std::uint32_t blocks = 0;
    for (int b = 0; b < 4 * 3 * 3; ++b) {
      const glm::ivec3 block(b % 4, b / 4 % 3, b / 12);
      const BlockRange& range = volume.blocks[volume.blockAt(block)];
      const Interval piece = cutToBox(ray, glm::dvec3(block * 4), glm::dvec3(block * 4 + 4), whole);
      blocks +=
          piece.t_max - piece.t_min > 1e-13 && range.stored && range.density_max >= 40 && range.density_min <= 190;
    }
    view.mode = Mode::blocks;
    EXPECT_EQ(renderPixel(volume, view, 0, 0).blocks, blocks) << i;
  }
}

TEST(Reference, DistancesToEdgesAndFacesAreMeasured) {
  DenseVolume volume = emptyVolume(VoxelType::rgba8, {8, 8, 8});
  setVoxel(volume, {4, 4, 2}, {255, 255, 255, 255});
  const auto pixelThrough = [&](glm::dvec3 eye, glm::dvec3 target) {
    View view = viewOf(eye, target, {0, 1, 0});
    view.mode = Mode::first_hit;
    return renderPixel(volume, view, 0, 0);
  };
  const Pixel middle = pixelThrough({4.5, 4.4, 20}, {4.5, 4.4, 0});
  EXPECT_NEAR(middle.edge_distance, 0.4, kTolerance);
  EXPECT_NEAR(middle.face_distance, 0.4, kTolerance);
  // Past the edge x = 4, z = 6 of voxel (4, 4, 5) at a distance of 0.002 / sqrt(2).
  const Pixel near_edge = pixelThrough({4.002 + 10, 4.5, 16}, {4.002 - 1, 4.5, 5});
  EXPECT_NEAR(near_edge.edge_distance, 0.002 / std::numbers::sqrt2, 1e-9);
  EXPECT_GT(near_edge.face_distance, 0.4);
  // Just beside the volume: missed, and known to be near the edges of its face.
  const Pixel beside = pixelThrough({8.0005, 4.5, 20}, {8.0005, 4.5, 0});
  EXPECT_EQ(beside.voxel, glm::ivec3(-1));
  EXPECT_NEAR(beside.edge_distance, 0.0005, 1e-9);
  EXPECT_GT(pixelThrough({9, 4.5, 20}, {9, 4.5, 0}).edge_distance, 0.9);
}

}  // namespace
}  // namespace blockwalk::reference
