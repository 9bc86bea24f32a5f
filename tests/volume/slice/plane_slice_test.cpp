// SPDX-License-Identifier: Apache-2.0
// Planes of any direction, held to slices along an axis and to interpolation by hand.
#include <gmock/gmock.h>

#include "tests/volume/slice/dense.h"

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;
using PlaneSlices = SliceVolumes;

constexpr glm::dvec3 kOrigin{-3, 8, 16.25};  // of SliceVolumes, whose voxels are half a unit wide

std::string planeFault(const VolumeInfo& info, const PlaneCut& plane, SliceCut cut = {}) {
  try {
    cut.plane = plane;
    planSlice(info, cut);
  } catch (const SliceError& error) {
    return error.field + "|" + error.what();
  }
  return "no error";
}

// Along the axes a plane is the slice, and outside there is nothing.
TEST_F(PlaneSlices, AlignedAreSlicesAlongAnAxisBitForBit) {
  for (const auto type : {VoxelType::u8, VoxelType::u16, VoxelType::f32, VoxelType::rgba8}) {
    const std::size_t channels = type == VoxelType::u16 ? 2 : 1;
    const VolumeFile file = build(type, channels, ValuesRule::intensity, true);
    for (int axis = 0; axis < 3; ++axis) {
      const int column_axis = axis == 0 ? 1 : 0;
      const int row_axis = axis == 2 ? 1 : 2;
      const AxisCut along{.axis = axis, .index = 21, .thickness = axis == 1 ? 5 : 1};
      const SliceReduce reduce = axis == 1 ? SliceReduce::min : axis == 0 ? SliceReduce::max : SliceReduce::mean;
      const SliceCut straight{.plane = along, .reduce = reduce};
      const SlicePlan plan = planSlice(file.info(), straight);
      const SlicePixels expected = readSlice(file, plan);
      PlaneCut plane{.pixel = 0.5, .width = plan.width + 4, .height = plan.height + 2};
      plane.right = {};
      plane.down = {};
      plane.right[column_axis] = 3;
      plane.down[row_axis] = 0.25;
      plane.centre = kOrigin + 0.25 * glm::dvec3(kSliceDims);
      plane.centre[axis] = kOrigin[axis] + 0.5 * 21.5;
      plane.thickness = axis == 1 ? 2.5 : 0;
      const SlicePixels pixels = readSlice(file, SliceCut{.plane = plane, .reduce = reduce});
      for (int row = 0; row < plane.height; ++row) {
        for (int column = 0; column < plane.width; ++column) {
          const auto pixel = static_cast<std::size_t>(row * plane.width + column);
          const bool is_inside = column >= 2 && column < plan.width + 2 && row >= 1 && row < plan.height + 1;
          const auto inner = static_cast<std::size_t>((row - 1) * plan.width + column - 2);
          if (type == VoxelType::rgba8) {
            ASSERT_EQ(pixels.colors[pixel], is_inside ? expected.colors[inner] : 0u) << axis;
            continue;
          }
          for (std::size_t channel = 0; channel < channels; ++channel) {
            const float value = pixels.values[channel][pixel];
            if (!is_inside) {
              ASSERT_TRUE(std::isnan(value));
            } else {
              ASSERT_TRUE(sameBits(value, expected.values[channel][inner]) ||
                          (std::isnan(value) && std::isnan(expected.values[channel][inner])))
                  << axis << " " << column << " " << row;
            }
          }
        }
      }
    }
  }
}

// A mean would weigh them by nothing.
TEST_F(PlaneSlices, KeepColoursWithoutOpacity) {
  constexpr std::uint32_t kClear = 0x00332211;
  constexpr std::uint32_t kOpaque = 0xff445566;
  MemorySource source = randomSource(VoxelType::rgba8, kSliceDims, 11);
  std::memcpy(source.at({10, 12, 21}, 0), &kClear, sizeof kClear);
  std::memcpy(source.at({11, 12, 21}, 0), &kOpaque, sizeof kOpaque);
  buildVolume(source, folder_ / "clear.bwv", {.subblock_side = 8});
  const VolumeFile file(folder_ / "clear.bwv");
  const glm::dmat4& world_from_index = file.info().world_from_index;
  const PlaneCut plane{.centre = glm::dvec3(world_from_index * glm::dvec4(11, 12.5, 21.5, 1)),
                       .pixel = glm::length(glm::dvec3(world_from_index[0])),
                       .width = 2,
                       .height = 1};
  for (const auto reduce : {SliceReduce::max, SliceReduce::min, SliceReduce::mean}) {
    const SlicePixels pixels = readSlice(file, SliceCut{.plane = plane, .reduce = reduce, .level = 0});
    EXPECT_EQ(pixels.colors, (std::vector<std::uint32_t>{kClear, kOpaque}));
  }
}

// Trilinear between voxel centres, clamped at the edge; empty voxels count as the empty value.
double interpolated(const VolumeFile& file, const Dense& dense, glm::dvec3 index) {
  const ChannelInfo& channel = file.info().channels[0];
  const glm::dvec3 low = glm::floor(index - 0.5);
  double sum = 0;
  for (int x = 0; x < 2; ++x) {
    for (int y = 0; y < 2; ++y) {
      for (int z = 0; z < 2; ++z) {
        const glm::dvec3 centre = low + glm::dvec3(x, y, z) + 0.5;
        const glm::dvec3 weights = 1.0 - glm::abs(index - centre);
        const glm::ivec3 voxel = glm::clamp(glm::ivec3(low) + glm::ivec3(x, y, z), glm::ivec3(0), dense.dims - 1);
        const float stored = dense.density(voxel);
        const float counted =
            isEmptyDensity(stored, channel.empty_threshold) ? emptyValue(dense.type, channel) : stored;
        sum += weights.x * weights.y * weights.z * static_cast<double>(counted);
      }
    }
  }
  return sum;
}

TEST_F(PlaneSlices, ObliqueAreNearestOrInterpolated) {
  const VolumeFile file = build(VoxelType::f32);
  const Dense dense = denseLevel(file, 0, 0);
  const glm::dvec3 right = glm::normalize(glm::dvec3(1, 0.4, -0.3));
  const glm::dvec3 wanted(0.1, 1, 0.6);
  const glm::dvec3 down = glm::normalize(wanted - glm::dot(wanted, right) * right);
  PlaneCut plane{.centre = {20, 25, 30}, .right = 7.0 * right, .down = wanted, .pixel = 0.4, .width = 90, .height = 70};
  int inside = 0;
  for (const bool is_linear : {false, true}) {
    plane.is_linear = is_linear;
    const SlicePixels pixels = readSlice(file, SliceCut{.plane = plane, .level = 0});
    for (int row = 0; row < plane.height; ++row) {
      for (int column = 0; column < plane.width; ++column) {
        const glm::dvec3 world = plane.centre + 0.4 * (column + 0.5 - 45) * right + 0.4 * (row + 0.5 - 35) * down;
        const glm::dvec3 index = (world - kOrigin) / 0.5;
        const float value = pixels.values[0][static_cast<std::size_t>(row * plane.width + column)];
        const bool is_inside = glm::all(glm::greaterThanEqual(index, glm::dvec3(0))) &&
                               glm::all(glm::lessThan(index, glm::dvec3(kSliceDims)));
        if (!is_inside) {
          ASSERT_TRUE(std::isnan(value)) << column << " " << row;
          continue;
        }
        ++inside;
        if (is_linear) {
          ASSERT_NEAR(value, interpolated(file, dense, index), 2e-3) << column << " " << row;
          continue;
        }
        // What lies on a face between voxels may belong to either.
        if (glm::any(glm::lessThan(glm::abs(index - glm::round(index)), glm::dvec3(1e-9)))) continue;
        ASSERT_TRUE(sameBits(value, dense.density(glm::ivec3(index)))) << column << " " << row;
      }
    }
  }
  EXPECT_GT(inside, 3000);
}

TEST_F(PlaneSlices, ChooseALevelAndSamplesByTheSizeOfAPixel) {
  const VolumeFile file = build(VoxelType::u8);
  const auto planOf = [&](double pixel, double thickness) {
    return planSlice(file.info(), {.plane = PlaneCut{.centre = {20, 25, 30}, .pixel = pixel, .thickness = thickness}});
  };
  EXPECT_EQ(planOf(0.5, 0).level, 0);
  EXPECT_EQ(planOf(0.99, 0).level, 0);
  EXPECT_EQ(planOf(1, 0).level, 1);
  EXPECT_EQ(planOf(0.5, 0).samples, 1);
  EXPECT_EQ(planOf(0.5, 0.6).samples, 2) << "samples are at most a voxel apart";
  EXPECT_EQ(planOf(0.5, 5).samples, 10);
  EXPECT_EQ(planOf(1, 5).samples, 5);
}

// The blocks of a ray are more than are held at a time: each is read once all the same, few in a step.
TEST_F(PlaneSlices, DeepSlabsReadEachBlockOnce) {
  constexpr int kLength = 200 * 48;
  MemorySource source = randomSource(VoxelType::f32, {kLength, 8, 8}, 5, true);
  buildVolume(source, folder_ / "bar.bwv", {.subblock_side = 8});
  const VolumeFile file(folder_ / "bar.bwv");
  const SliceCut straight{.plane = AxisCut{.axis = 0, .index = kLength / 2 - 1, .thickness = kLength},
                          .reduce = SliceReduce::max,
                          .level = 0};
  const SlicePixels expected = readSlice(file, straight);
  const glm::dmat4& world_from_index = file.info().world_from_index;
  const double side = glm::length(glm::dvec3(world_from_index[0]));
  const PlaneCut plane{.centre = glm::dvec3(world_from_index * glm::dvec4(kLength / 2, 4, 4, 1)),
                       .right = {0, 1, 0},
                       .down = {0, 0, 1},
                       .pixel = side,
                       .width = 8,
                       .height = 8,
                       .thickness = kLength * side};
  const SlicePlan plan = planSlice(file.info(), {.plane = plane, .reduce = SliceReduce::max, .level = 0});
  const auto reader = makeSliceReader(file, plan);
  std::uint64_t before = 0;
  for (bool has_more = true; has_more; before = reader->blocksRead()) {
    has_more = reader->step();
    ASSERT_LE(reader->blocksRead() - before, static_cast<std::uint64_t>(SliceReader::kBlocksOfStep));
  }
  EXPECT_EQ(before, 200u);
  EXPECT_EQ(reader->take().values, expected.values);
}

// Each pixel lies in other blocks: 8 of them, between their corners.
TEST_F(PlaneSlices, StepsOfPixelsFarApartAreShort) {
  MemorySource source = randomSource(VoxelType::u8, {48 * 30, 48 * 30, 6}, 5);
  buildVolume(source, folder_ / "board.bwv", {.subblock_side = 8});
  const VolumeFile file(folder_ / "board.bwv");
  const double side = glm::length(glm::dvec3(file.info().world_from_index[0]));
  const PlaneCut plane{.centre = glm::dvec3(file.info().world_from_index * glm::dvec4(48 * 15, 48 * 15, 3, 1)),
                       .right = {1, 0, 0},
                       .down = {0, 1, 0},
                       .pixel = 48 * side,
                       .width = 29,
                       .height = 29,
                       .is_linear = true};
  const auto reader = makeSliceReader(file, planSlice(file.info(), {.plane = plane, .level = 0}));
  std::uint64_t before = 0;
  for (bool has_more = true; has_more; before = reader->blocksRead()) {
    has_more = reader->step();
    ASSERT_LT(reader->blocksRead() - before, static_cast<std::uint64_t>(SliceReader::kBlocksOfStep) + 8);
  }
  EXPECT_EQ(before, 900u);
}

TEST_F(PlaneSlices, RefuseMoreBlocksThanMayBeRead) {
  VolumeInfo info = build(VoxelType::u8).info();
  info.dims = glm::ivec3(20000);
  info.levels.resize(1);
  info.levels[0].dims = info.dims;
  info.world_from_index = glm::dmat4(1);
  PlaneCut plane{.centre = glm::dvec3(10000), .right = {1, 0.3, 0}, .down = {0, 1, 0.5}, .width = 8192, .height = 8192};
  EXPECT_EQ(planeFault(info, plane), "no error") << "all of a plane, voxel by voxel";
  plane.width = plane.height = 2048;
  plane.pixel = 8;
  plane.thickness = 400;
  EXPECT_THAT(planeFault(info, plane),
              testing::MatchesRegex("level\\|level: 0: some [0-9]+ blocks of the volume would be "
                                    "read, at most 262144 may be: .*"));
  plane.thickness = 0;
  EXPECT_EQ(planeFault(info, plane), "no error");
  plane.pixel = 1e6;
  EXPECT_EQ(planeFault(info, plane), "no error") << "most of it lies outside";
}

TEST_F(PlaneSlices, RefuseWhatIsUndefined) {
  const VolumeFile file = build(VoxelType::u8);
  const VolumeInfo& info = file.info();
  const PlaneCut plain{.centre = {20, 25, 30}};
  EXPECT_EQ(planeFault(info, plain), "no error");
  PlaneCut cut = plain;
  cut.right = {0, 0, 0};
  EXPECT_EQ(planeFault(info, cut), "right|right: has no direction");
  cut = plain;
  cut.down = {-2, 0, 0};
  EXPECT_EQ(planeFault(info, cut), "down|down: is parallel to right");
  cut = plain;
  cut.centre.x = 1e300;
  EXPECT_THAT(planeFault(info, cut), HasSubstr("centre|centre: lies"));
  cut = plain;
  cut.pixel = 1e-300;
  EXPECT_THAT(planeFault(info, cut), HasSubstr("pixel|pixel: 1e-300 is not within"));
  cut = plain;
  cut.thickness = 1000;
  EXPECT_THAT(planeFault(info, cut), HasSubstr("thickness|thickness: 1000 is not within 0..66"));
  cut = plain;
  cut.width = cut.height = 8192;
  EXPECT_EQ(planeFault(info, cut), "no error");
  cut.thickness = 60;
  EXPECT_THAT(planeFault(info, cut, {.plane = {}, .level = 0}),
              HasSubstr("thickness|thickness: 120 voxels through 67108864 pixels"));
  const VolumeFile labels = build(VoxelType::u8, 1, ValuesRule::labels);
  cut = plain;
  cut.is_linear = true;
  EXPECT_THAT(planeFault(labels.info(), cut), HasSubstr("filter|filter: linear: channel 0 holds labels"));
}

}  // namespace
}  // namespace blockwalk::volume_test
