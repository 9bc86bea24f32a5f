// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "tests/volume/memory_source.h"
#include "volume/build/budget.h"
#include "volume/demo/demo.h"
#include "volume/demo/noise.h"
#include "volume/error.h"

namespace blockwalk::volume_test {
namespace {

std::vector<std::byte> voxelsOf(Source& source) {
  const glm::ivec3 dims = source.info().dims;
  const std::size_t slice = channelRowBytes(source.info()) * static_cast<std::size_t>(dims.y);
  std::vector<std::byte> all(slice * static_cast<std::size_t>(dims.z));
  for (int z = 0; z < dims.z; ++z) {
    source.readRows(z, 0, dims.y, std::span(all).subspan(static_cast<std::size_t>(z) * slice, slice));
  }
  return all;
}

BuildBudget workers(int count) {
  BuildBudget budget = budgetOf(BuildOptions{}.memory_bytes);
  budget.workers = count;
  return budget;
}

// Every voxel outside of the runs of a box is 0, whatever the box, and the box's own voxels are those of the rows.
TEST(DemoCosmos, SaysWhereItIsBlank) {
  constexpr int kSize = 300;
  const auto source = openDemo("cosmos", kSize);
  ASSERT_EQ(source->info().blank, std::vector<std::byte>(2));
  const std::vector<std::byte> whole = voxelsOf(*source);
  HashSequence hash(5);
  std::uint64_t said_blank = 0;
  std::uint64_t looked_at = 0;
  for (int i = 0; i < 1000; ++i) {
    VoxelBox box;
    const int side = i % 4 == 0 ? kSize : i % 4 == 1 ? 48 : 8;
    for (int axis = 0; axis < 3; ++axis) {
      box.begin[axis] = static_cast<int>(hash.between(0, kSize));
      const int most = axis == 0 ? 4 * side : side;
      box.end[axis] = std::min(kSize, box.begin[axis] + 1 + static_cast<int>(hash.between(0, most)));
    }
    std::vector<VoxelRun> runs;
    source->findRuns(box, runs);
    std::vector<std::byte> voxels(static_cast<std::size_t>(box.dims().x * box.dims().y * box.dims().z) * 2);
    source->readBox(box, voxels);
    const std::byte* voxel = voxels.data();
    for (int z = box.begin.z; z < box.end.z; ++z) {
      for (int y = box.begin.y; y < box.end.y; ++y) {
        for (int x = box.begin.x; x < box.end.x; ++x, voxel += 2) {
          ASSERT_EQ(std::memcmp(voxel, &whole[static_cast<std::size_t>((z * kSize + y) * kSize + x) * 2], 2), 0);
          const bool is_blank =
              std::ranges::none_of(runs, [x](const VoxelRun& run) { return x >= run.begin && x < run.end; });
          ASSERT_TRUE(!is_blank || storedDensity(VoxelType::u16, voxel) == 0) << x << ' ' << y << ' ' << z;
          said_blank += side == 8 && is_blank ? 1 : 0;
          looked_at += side == 8 ? 1 : 0;
        }
      }
    }
  }
  EXPECT_GT(said_blank, looked_at / 3) << "of small boxes";
}

TEST(DemoCosmos, HasTwoTypes) {
  const std::vector<std::byte> integers = voxelsOf(*openDemo("cosmos", 64));
  const auto source = openDemo("cosmos", 64, VoxelType::f32);
  ASSERT_EQ(source->info().type, VoxelType::f32);
  const std::vector<std::byte> reals = voxelsOf(*source);
  for (std::size_t i = 0; i < integers.size() / 2; ++i) {
    ASSERT_EQ(storedDensity(VoxelType::f32, &reals[4 * i]) * 65536, storedDensity(VoxelType::u16, &integers[2 * i]));
  }
  EXPECT_THROW(openDemo("cosmos", 64, VoxelType::u8), DataError);
  EXPECT_THROW(openDemo("fossil", 64, VoxelType::f32), DataError);
}

// What is not empty gets thinner as sizes grow.
TEST(DemoCosmos, OfLargeSizesIsEmptyNearlyEverywhere) {
  const auto source = openDemo("cosmos", 16384);
  std::uint64_t filled = 0;
  for (int slab = 0; slab < 8; ++slab) {
    std::vector<VoxelRun> runs;
    for (int y = 0; y < 16384; y += 64) {
      const glm::ivec3 begin(0, y, 1000 + 2000 * slab);
      source->findRuns({.begin = begin, .end = begin + glm::ivec3(16384, 8, 8)}, runs);
      for (const VoxelRun& run : runs) filled += static_cast<std::uint64_t>(run.end - run.begin);
    }
  }
  EXPECT_GT(filled, 0u);
  EXPECT_LT(filled, std::uint64_t{8} * 256 * 16384 / 500) << "voxels of 8 x 8 x 8 that may hold something";
}

TEST(DemoCosmos, IsTheSameWhateverTheWorkers) {
  const ScratchFolder folder;
  const auto source = openDemo("cosmos", 200);
  buildVolume(*source, folder / "one.bwv", {}, workers(1));
  buildVolume(*source, folder / "several.bwv", {}, workers(4));
  EXPECT_EQ(readBytes(folder / "one.bwv"), readBytes(folder / "several.bwv"));
  // And that of rows which are all read.
  const auto voxels = std::make_shared<MemorySource>(VoxelType::u16, source->info().dims);
  voxels->change() = source->info();
  voxels->change().blank.clear();
  for (int z = 0; z < 200; ++z) {
    const std::size_t slice = voxels->voxels.size() / 200;
    source->readRows(z, 0, 200, std::span(voxels->voxels).subspan(static_cast<std::size_t>(z) * slice, slice));
  }
  buildVolume(*voxels, folder / "rows.bwv", {}, workers(2));
  EXPECT_EQ(readBytes(folder / "rows.bwv"), readBytes(folder / "one.bwv"));
}

}  // namespace
}  // namespace blockwalk::volume_test
