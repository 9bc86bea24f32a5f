// SPDX-License-Identifier: Apache-2.0
// Numbers of a view that could not be drawn right are refused, and the member that is to blame is named.
#include <gtest/gtest.h>

#include <functional>

#include "view/resolved_view.h"

namespace blockwalk {
namespace {

VolumeInfo volumeOfSide(int side, double spacing) {
  VolumeInfo info;
  info.type = VoxelType::rgba8;
  info.dims = glm::ivec3(side);
  info.world_from_index = glm::dmat4(spacing);
  info.world_from_index[3][3] = 1;
  info.channels[0].density_min = 1;
  info.channels[0].density_max = 255;
  info.levels.push_back({.dims = info.dims, .block_count = 1, .subblock_count = 1, .voxel_bytes = 512});
  return info;
}

// The field of the error; empty: it resolves.
std::string refusedField(const VolumeInfo& info, const std::function<void(View&)>& change) {
  View view;
  change(view);
  try {
    resolveView(view, info);
  } catch (const ViewError& error) {
    return error.field;
  }
  return "";
}

TEST(Reach, WhatIsTooFarToBeDrawnNamesItsMember) {
  for (const double spacing : {1e-9, 1.0, 1e9}) {
    const VolumeInfo info = volumeOfSide(48, spacing);
    const double diagonal = spacing * 48 * std::sqrt(3.0);
    const auto refused = [&](const std::function<void(View&)>& change) { return refusedField(info, change); };
    for (const double far : {1.01e11 * diagonal, 1e60, 1e160, 1e308}) {
      EXPECT_EQ(refused([&](View& v) { v.ortho_height = far; }), "ortho") << far;
      EXPECT_EQ(refused([&](View& v) { v.eye = glm::dvec3(0, far, 0); }), "eye") << far;
      EXPECT_EQ(refused([&](View& v) { v.eye = glm::dvec3(far); }), "eye") << far;
      EXPECT_EQ(refused([&](View& v) { v.target = glm::dvec3(0, 0, -far); }), "target") << far;
    }
    EXPECT_EQ(refused([&](View& v) { v.fov_degrees = 1e-10; }), "fov");
    EXPECT_EQ(refused([&](View& v) { v.fov_degrees = 1e-300; }), "fov");
  }
}

TEST(Reach, WhatCanBeDrawnIsTaken) {
  for (const double spacing : {1e-9, 1.0, 1e9}) {
    for (const int side : {1, 48, 65536}) {
      const VolumeInfo info = volumeOfSide(side, spacing);
      const double diagonal = spacing * side * std::sqrt(3.0);
      const auto refused = [&](const std::function<void(View&)>& change) { return refusedField(info, change); };
      EXPECT_EQ(refused([](View&) {}), "");
      EXPECT_EQ(refused([](View& v) { v.fov_degrees = 1e-9; }), "") << "framed from as far as a volume is framed from";
      EXPECT_EQ(refused([&](View& v) { v.ortho_height = 0.99e11 * diagonal; }), "");
      EXPECT_EQ(refused([](View& v) { v.ortho_height = 1e-300; }), "");
      EXPECT_EQ(refused([&](View& v) { v.eye = glm::dvec3(0, 0, 0.99e11 * diagonal); }), "");
      EXPECT_EQ(refused([&](View& v) {
                  v.eye = glm::dvec3(diagonal);
                  v.target = glm::dvec3(1e140, 0, 1e100);
                }),
                "")
          << "a target far away is a direction";
      EXPECT_EQ(refused([](View& v) { v.extinction = 1e300; }), "");
    }
  }
}

}  // namespace
}  // namespace blockwalk
