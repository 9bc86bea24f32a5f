// SPDX-License-Identifier: Apache-2.0
#include "volume/build/fitting_sides.h"

#include <gtest/gtest.h>

#include "tests/volume/file/file_contents.h"
#include "tests/volume/memory_source.h"
#include "volume/build/builder.h"

namespace blockwalk::volume_test {
namespace {

TEST(FittingSides, AreSmallForFewSlices) {
  EXPECT_EQ(fittingSubblockSide({512, 512, 300}), 8);
  EXPECT_EQ(fittingSubblockSide({512, 512, 2}), 4);
  EXPECT_EQ(fittingSubblockSide({512, 512, 1}), 4);
  EXPECT_EQ(fittingSubblockSide({512, 512, 7}), 8) << "both store 8 slices";
  EXPECT_EQ(fittingSubblockSide({4, 4, 4}), 4);
  EXPECT_EQ(fittingSubblockSide({1, 1, 1}), 4);
  EXPECT_EQ(paddingFactor({512, 512, 2}, 8), 4);
  EXPECT_EQ(paddingFactor({10, 8, 8}, 8), 1.6);
}

// Two slices of noise take about what they are.
TEST(FittingSides, TwoSlicesTakeAboutTheirDenseSize) {
  const ScratchFolder folder;
  const glm::ivec3 dims(200, 160, 2);
  MemorySource source(VoxelType::u16, dims);
  std::mt19937 random(4);
  for (int z = 0; z < dims.z; ++z) {
    for (int y = 0; y < dims.y; ++y) {
      for (int x = 0; x < dims.x; ++x) source.set({x, y, z}, static_cast<std::uint16_t>(1 + random() % 60000));
    }
  }
  BuildOptions options;
  options.subblock_side = fittingSubblockSide(dims);
  options.codec = Codec::lz4;
  const BuildReport report = buildVolume(source, folder / "v.bwv", options);
  const double dense = 200.0 * 160 * 2 * 2;
  EXPECT_LT(static_cast<double>(report.level0_voxel_bytes), 1.2 * dense);
}

}  // namespace
}  // namespace blockwalk::volume_test
