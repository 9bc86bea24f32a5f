// SPDX-License-Identifier: Apache-2.0
// The smallest and the longest images.
#include <fmt/format.h>

#include "tests/extreme/cases.h"
#include "tests/extreme/gauge.h"
#include "tests/extreme/volumes.h"

namespace blockwalk::extreme {
namespace {

Case sized(int width, int height, double fov) {
  return {fmt::format("size_{}x{}", width, height), fmt::format("an image of {}x{} pixels", width, height), [=] {
            Scenario scenario{.source = clumps(VoxelType::rgba8, {56, 54, 52}),
                              .view = look(glm::dmat4(1), {70, 60, 130}, {28, 27, 26})};
            scenario.view.channels[0].range = DensityRange{.lo = 60, .hi = 255};
            scenario.view.width = width;
            scenario.view.height = height;
            scenario.view.fov_degrees = fov;
            return imageError(scenario);
          }};
}

}  // namespace

std::vector<Case> sizeCases() {
  return {
      sized(1, 1, 40),      sized(1, 8192, 40), sized(8192, 1, 0.005),  // 41 degrees wide
      sized(8192, 8, 0.04), sized(7, 3, 40),
  };
}

}  // namespace blockwalk::extreme
