// SPDX-License-Identifier: Apache-2.0
// Slices along an axis, held to dense arrays of the volume.
#include <gmock/gmock.h>

#include "tests/volume/slice/dense.h"

namespace blockwalk::volume_test {
namespace {

using testing::HasSubstr;
using AxisSlices = SliceVolumes;

// "field|message", or "no error".
std::string axisFault(const VolumeInfo& info, const SliceCut& cut) {
  try {
    planSlice(info, cut);
  } catch (const SliceError& error) {
    return error.field + "|" + error.what();
  }
  return "no error";
}

TEST_F(AxisSlices, AreWhatIsStoredBitForBit) {
  for (const auto& [type, channels] :
       {std::pair{VoxelType::u8, 1}, {VoxelType::u16, 2}, {VoxelType::f32, 2}, {VoxelType::rgba8, 1}}) {
    const VolumeFile file = build(type, static_cast<std::size_t>(channels));
    for (int axis = 0; axis < 3; ++axis) {
      for (const int index : {0, 47, 48, kSliceDims[axis] - 1}) {
        const SliceCut cut{.plane = AxisCut{.axis = axis, .index = index}};
        const SlicePlan plan = planSlice(file.info(), cut);
        EXPECT_EQ(plan.level, 0);
        EXPECT_EQ(plan.width, kSliceDims[axis == 0 ? 1 : 0]);
        EXPECT_EQ(plan.height, kSliceDims[axis == 2 ? 1 : 2]);
        const SlicePixels pixels = readSlice(file, plan);
        for (int channel = 0; channel < channels; ++channel) {
          const Dense dense = denseLevel(file, 0, channel);
          std::size_t pixel = 0;
          for (int row = 0; row < plan.height; ++row) {
            for (int column = 0; column < plan.width; ++column, ++pixel) {
              const glm::ivec3 voxel = voxelOf(axis, column, row, index);
              if (type == VoxelType::rgba8) {
                ASSERT_EQ(pixels.colors[pixel], dense.color(voxel)) << axis << " " << column << " " << row;
              } else {
                ASSERT_TRUE(sameBits(pixels.values[static_cast<std::size_t>(channel)][pixel], dense.density(voxel)))
                    << axis << " " << column << " " << row;
              }
            }
          }
        }
      }
    }
  }
}

// By plain loops over the level's voxels.
float expectedOf(const Dense& dense, const AxisCut& cut, SliceReduce reduce, int level, glm::ivec3 first) {
  const int begin = std::max(0, cut.index - (cut.thickness - 1) / 2);
  const int end = std::min(kSliceDims[cut.axis], cut.index - (cut.thickness - 1) / 2 + cut.thickness);
  double sum = 0;
  double weight = 0;
  double least = INFINITY;
  double most = -INFINITY;
  for (int fine = begin; fine < end; ++fine) {  // voxel by voxel of level 0
    glm::ivec3 voxel = first;
    voxel[cut.axis] = fine >> level;
    const auto value = static_cast<double>(dense.density(voxel));
    if (!std::isfinite(value)) continue;
    sum += value;
    weight += 1;
    least = std::min(least, value);
    most = std::max(most, value);
  }
  if (weight == 0) return NAN;
  return static_cast<float>(reduce == SliceReduce::mean ? sum / weight : reduce == SliceReduce::min ? least : most);
}

TEST_F(AxisSlices, ReduceSlabsOfEveryLevel) {
  for (const auto type : {VoxelType::u16, VoxelType::f32}) {
    const VolumeFile file = build(type, 2, ValuesRule::intensity, true);
    for (const SliceReduce reduce : {SliceReduce::max, SliceReduce::min, SliceReduce::mean}) {
      for (int level = 0; level < 2; ++level) {
        const Dense dense = denseLevel(file, level, 1);
        for (const AxisCut& along :
             {AxisCut{.axis = 2, .index = 20, .thickness = 2}, AxisCut{.axis = 0, .index = 50, .thickness = 9},
              AxisCut{.axis = 1, .index = 1, .thickness = 40}, AxisCut{.axis = 2, .index = 52, .thickness = 65536}}) {
          const SliceCut cut{.plane = along, .reduce = reduce, .level = level, .channels = {1}};
          const SlicePlan plan = planSlice(file.info(), cut);
          const SlicePixels pixels = readSlice(file, plan);
          for (int row = 0; row < plan.height; ++row) {
            for (int column = 0; column < plan.width; ++column) {
              const float expected = expectedOf(dense, along, reduce, level, voxelOf(along.axis, column, row, 0));
              const float value = pixels.values[0][static_cast<std::size_t>(row * plan.width + column)];
              if (std::isnan(expected)) {
                // A slab of one voxel of the level has what is stored.
                ASSERT_FALSE(std::isfinite(value));
              } else if (reduce == SliceReduce::mean) {
                ASSERT_NEAR(value, expected, 1e-5 * std::abs(expected) + 1e-5) << level << " " << column << " " << row;
              } else {
                ASSERT_EQ(value, expected) << level << " " << column << " " << row;
              }
            }
          }
        }
      }
    }
  }
}

// The maximum of a slab is that of the voxels of level 0 under its pixels, however coarse the level is.
TEST_F(AxisSlices, MaximaAreTrueOnCoarseLevels) {
  const VolumeFile file = build(VoxelType::u16);
  ASSERT_TRUE(file.info().has(2, Form::maxima));
  const Dense dense = denseLevel(file, 0, 0);
  const AxisCut along{.axis = 1, .index = 30, .thickness = 8};  // voxels 27 to 34: of level 2 those from 24 to 35
  const SlicePlan plan = planSlice(file.info(), {.plane = along, .level = 2});
  EXPECT_EQ(plan.form, Form::maxima);
  const SlicePixels pixels = readSlice(file, plan);
  int shown = 0;
  for (int row = 0; row < plan.height; ++row) {
    for (int column = 0; column < plan.width; ++column) {
      float most = 0;
      for (int z = 4 * row; z < std::min(4 * row + 4, kSliceDims.z); ++z) {
        for (int y = 24; y < 36; ++y) {
          for (int x = 4 * column; x < std::min(4 * column + 4, kSliceDims.x); ++x) {
            most = std::max(most, dense.density({x, y, z}));
          }
        }
      }
      shown += most > 0 ? 1 : 0;
      ASSERT_EQ(pixels.values[0][static_cast<std::size_t>(row * plan.width + column)], most) << column << " " << row;
    }
  }
  EXPECT_GT(shown, 20);
  EXPECT_EQ(planSlice(file.info(), {.plane = AxisCut{.axis = 1, .index = 30}, .level = 2}).form, Form::values);
}

TEST_F(AxisSlices, ABoxCutsThePicture) {
  const VolumeFile file = build(VoxelType::u8);
  for (int level = 0; level < 2; ++level) {
    const Dense dense = denseLevel(file, level, 0);
    const AxisCut along{.axis = 0, .index = 60, .box = VoxelBox{{0, 7, 30}, {1, 60, 53}}};
    const SlicePlan plan = planSlice(file.info(), {.plane = along, .level = level});
    const int side = 1 << level;
    const glm::ivec3 begin(60 / side, 7 / side, 30 / side);
    EXPECT_EQ(plan.width, (60 + side - 1) / side - begin.y);
    EXPECT_EQ(plan.height, (53 + side - 1) / side - begin.z);
    const SlicePixels pixels = readSlice(file, plan);
    for (int row = 0; row < plan.height; ++row) {
      for (int column = 0; column < plan.width; ++column) {
        ASSERT_EQ(pixels.values[0][static_cast<std::size_t>(row * plan.width + column)],
                  dense.density(begin + glm::ivec3(0, column, row)));
      }
    }
    // The corner in the world, and from pixel to pixel.
    EXPECT_EQ(plan.corner, glm::dvec3(-3, 8, 16.25) + 0.5 * side * glm::dvec3(begin));
    EXPECT_EQ(plan.right, glm::dvec3(0, 0.5 * side, 0));
    EXPECT_EQ(plan.down, glm::dvec3(0, 0, 0.5 * side));
    EXPECT_EQ(plan.through, glm::dvec3(0.5 * side, 0, 0));
  }
}

TEST_F(AxisSlices, ColoursAreReducedByOpacity) {
  const VolumeFile file = build(VoxelType::rgba8);
  const Dense dense = denseLevel(file, 0, 0);
  for (const SliceReduce reduce : {SliceReduce::max, SliceReduce::min, SliceReduce::mean}) {
    const SliceCut cut{.plane = AxisCut{.axis = 2, .index = 20, .thickness = 3}, .reduce = reduce};
    const SlicePixels pixels = readSlice(file, cut);
    std::size_t pixel = 0;
    for (int y = 0; y < kSliceDims.y; ++y) {
      for (int x = 0; x < kSliceDims.x; ++x, ++pixel) {
        std::uint32_t chosen = dense.color({x, y, 19});
        double red = 0;
        double opacity = 0;
        for (int z = 19; z < 22; ++z) {
          const std::uint32_t color = dense.color({x, y, z});
          const bool is_better = reduce == SliceReduce::max ? color >> 24 > chosen >> 24 : color >> 24 < chosen >> 24;
          if (is_better) chosen = color;
          red += static_cast<double>(color >> 24) * static_cast<double>(color & 255u);
          opacity += static_cast<double>(color >> 24);
        }
        if (reduce != SliceReduce::mean) {
          ASSERT_EQ(pixels.colors[pixel], chosen);
          continue;
        }
        ASSERT_EQ(pixels.colors[pixel] >> 24, static_cast<std::uint32_t>(std::lround(opacity / 3)));
        ASSERT_EQ(pixels.colors[pixel] & 255u,
                  opacity > 0 ? static_cast<std::uint32_t>(std::lround(red / opacity)) : 0u);
      }
    }
  }
}

TEST_F(AxisSlices, RefuseWhatIsNotThere) {
  const VolumeFile file = build(VoxelType::u8);
  const VolumeInfo& info = file.info();
  const auto at = [](AxisCut along, int level = kAutoSliceLevel) { return SliceCut{.plane = along, .level = level}; };
  EXPECT_EQ(axisFault(info, at({.axis = 1, .index = 67})), "index|index: 67 is not within 0..66, the voxels along y");
  EXPECT_THAT(axisFault(info, at({.axis = 1, .index = -1})), HasSubstr("index|index: -1"));
  EXPECT_THAT(axisFault(info, at({}, 9)), HasSubstr("level|level: 9 is not within 0..2"));
  EXPECT_EQ(axisFault(info, at({.box = VoxelBox{{0, 0, 0}, {1, 1, 54}}})),
            "box|box: 0..54 along z is not within 0..53");
  EXPECT_THAT(axisFault(info, {.plane = AxisCut{}, .channels = {1}}),
              HasSubstr("channels|channels: 1 is not within 0..0"));
  const VolumeFile labels = build(VoxelType::u8, 1, ValuesRule::labels);
  const SliceCut mean{.plane = AxisCut{.thickness = 3}, .reduce = SliceReduce::mean};
  EXPECT_THAT(axisFault(labels.info(), mean), HasSubstr("reduce|reduce: mean: channel 0 holds labels"));
}

// Volumes that nobody needs to have: the plan is made of what is known of them.
TEST_F(AxisSlices, AreBoundedAndCoarseWhereTheyAreLarge) {
  VolumeInfo info;
  info.dims = {65536, 5000, 65536};
  for (int level = 0; level < 12; ++level) {
    info.levels.push_back({.dims = levelDims(info.dims, level)});
  }
  const SlicePlan plan = planSlice(info, {.plane = AxisCut{.axis = 2, .index = 7}});
  EXPECT_EQ(plan.level, 5);
  EXPECT_EQ(plan.width, 2048);
  EXPECT_EQ(plan.height, 157);
  EXPECT_THAT(axisFault(info, {.plane = AxisCut{.axis = 1}, .level = 2}),
              HasSubstr("level|level: 2: the picture has 16384 x 16384 pixels, at most 8192 a side"));
  EXPECT_THAT(axisFault(info, {.plane = AxisCut{.axis = 1, .thickness = 500}, .level = 3}), HasSubstr("no error"));
  EXPECT_THAT(
      axisFault(info, {.plane = AxisCut{.axis = 2, .thickness = 65536, .box = VoxelBox{{0, 0, 0}, {8192, 5000, 1}}},
                       .level = 0}),
      HasSubstr("thickness|thickness: 32769 voxels through 40960000 pixels"));
}

}  // namespace
}  // namespace blockwalk::volume_test
