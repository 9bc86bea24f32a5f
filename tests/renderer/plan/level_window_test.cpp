// SPDX-License-Identifier: Apache-2.0
#include "renderer/plan/level_window.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/renderer/plan/plans.h"

namespace blockwalk {
namespace {

VolumeInfo tilted() {
  VolumeInfo info = volumeOf(VoxelType::u8, 1, 255);
  info.dims = {4000, 3000, 5000};
  info.levels.clear();
  for (int level = 0; level < levelCount(info.dims, info.blockVoxels()); ++level) {
    info.levels.push_back({.dims = levelDims(info.dims, level),
                           .block_count = 100000,
                           .subblock_count = 400000,
                           .voxel_bytes = 0,
                           .apron_block_count = 200000,
                           .apron_subblock_count = 900000});
  }
  info.world_from_index = glm::dmat4(glm::dvec4(0.5, 0.1, 0, 0), glm::dvec4(-0.1, 0.7, 0.05, 0),
                                     glm::dvec4(0, -0.02, 2, 0), glm::dvec4(30, -20, 10, 1));
  return info;
}

View randomView(std::mt19937& random, const VolumeInfo& info) {
  std::uniform_real_distribution<double> unit(-0.3, 1.3);
  const WorldBox box = worldBox(info);
  const auto place = [&] {
    return box.min + glm::dvec3(unit(random), unit(random), unit(random)) * (box.max - box.min);
  };
  View view;
  view.width = 90;
  view.height = 60;
  view.eye = place();
  view.target = place();
  view.up = glm::dvec3(0.2, 1, -0.1);
  if (random() % 4 == 0) view.ortho_height = 900;
  if (random() % 3 == 0) {
    const glm::dvec3 a = place();
    const glm::dvec3 b = place();
    view.clip = ClipBox{.min = glm::min(a, b), .max = glm::max(a, b)};
  }
  return view;
}

// Whatever a ray meets of the volume between two depths, and what is interpolated there, lies in a block of the window.
TEST(LevelWindow, HoldsAllThatRaysComeTo) {
  const VolumeInfo info = tilted();
  const glm::dmat4 index_from_world = glm::inverse(info.world_from_index);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  int inside = 0;
  int partial = 0;
  for (int number = 0; number < 200; ++number) {
    const ResolvedView view = resolveView(randomView(random, info), info);
    const Camera& camera = view.camera;
    const int level = number % 4;
    const double near = number % 2 == 0 ? 0 : 400;
    const double far = number % 3 == 0 ? kInfinity : near + 700;
    const BlockWindow window = levelWindow(view, info, level, near, far);
    const glm::ivec3 lattice = latticeDims(levelDims(info.dims, level), info.blockVoxels());
    EXPECT_TRUE(glm::all(glm::lessThan(window.begin, window.end)));
    EXPECT_TRUE(glm::all(glm::lessThan(window.begin, lattice)));
    partial += window.holds(lattice) ? 0 : 1;
    for (int i = 0; i < 500; ++i) {
      const double depth = near + unit(random) * (std::isinf(far) ? 12000 : far - near);
      const double widening = camera.orthographic ? 1 : depth;
      const glm::dvec3 world = camera.eye + depth * camera.forward +
                               (2 * unit(random) - 1) * widening * camera.half_width * camera.right +
                               (2 * unit(random) - 1) * widening * camera.half_height * camera.up;
      if (view.clip &&
          (glm::any(glm::lessThan(world, view.clip->min)) || glm::any(glm::greaterThan(world, view.clip->max)))) {
        continue;
      }
      const glm::dvec3 index = glm::dvec3(index_from_world * glm::dvec4(world, 1));
      if (glm::any(glm::lessThan(index, glm::dvec3(0))) ||
          glm::any(glm::greaterThanEqual(index, glm::dvec3(info.dims)))) {
        continue;
      }
      ++inside;
      for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 beside(corner & 1, corner >> 1 & 1, corner >> 2);
        const glm::ivec3 voxel = glm::floor(index / std::ldexp(1.0, level) + 2.0 * beside - 1.0);
        const glm::ivec3 block = glm::clamp(voxel, glm::ivec3(0), levelDims(info.dims, level) - 1) / info.blockVoxels();
        EXPECT_TRUE(window.contains(block)) << number;
      }
    }
  }
  EXPECT_GT(inside, 10000);
  EXPECT_GT(partial, 100);
}

TEST(LevelWindow, LevelsAreWindowedByTheirRecordsAlone) {
  const VolumeInfo info = tilted();
  View view;
  view.eye = glm::dvec3(500, 500, 500);
  view.target = glm::dvec3(900, 600, 2000);
  view.level = 0;
  DeviceTraits device{.page_above_bytes = 1 << 20, .page_room_bytes = 1 << 20};
  EXPECT_EQ(planFor(view, info, device).window, BlockWindow{});
  device.record_room_bytes = std::uint64_t{1} << 40;
  EXPECT_EQ(planFor(view, info, device).window, BlockWindow{});
  device.record_room_bytes = 1 << 20;
  const Plan windowed = planFor(view, info, device);
  EXPECT_NE(windowed.window, BlockWindow{});
  EXPECT_EQ(windowed.coarse.at(*windowed.stand_in).window, BlockWindow{}) << "what stands in is there as a whole";
  // A window that found no room is not asked for again where the level is left to us.
  device.most_window_cells = cellsIn(windowed.window);
  EXPECT_EQ(planFor(view, info, device).level, 0);
  view.level = kAutoLevel;
  const Plan automatic = planFor(view, info, device);
  EXPECT_EQ(automatic.level, 0) << "a window that ends where a coarser level begins is a smaller one";
  device.most_window_cells = cellsIn(automatic.window);
  EXPECT_GT(planFor(view, info, device).level, 0);
  EXPECT_TRUE(planFor(view, info, device).is_coarser);
}

}  // namespace
}  // namespace blockwalk
