// SPDX-License-Identifier: Apache-2.0
// The reference's least and attenuated greatest values along a ray against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/reference/converged.h"
#include "tests/reference/field.h"
#include "tests/reference/ray.h"
#include "tests/renderer/closed_forms.h"

namespace blockwalk::reference {
namespace {

// Of a hat of one voxel only that voxel is seen, whole, though its field goes down to nothing around it.
TEST(AnalyticMinip, LooksAtWhatIsVisibleAlone) {
  const DenseVolume hat = oneVoxel(VoxelType::rgba8, glm::ivec3(8), glm::ivec3(3), {255, 0, 0, 200});
  for (Filter filter : {Filter::nearest, Filter::linear}) {
    View view = alongZ(3.2, 3.9, Mode::minip);
    view.filter = filter;
    const Pixel pixel = pixelOf(hat, view);
    EXPECT_NEAR(pixel.value, 200, kTolerance);
    EXPECT_NEAR(pixel.t, filter == Filter::nearest ? 20 : 24 - 3.75, kTolerance);
    EXPECT_EQ(pixel.color, glm::dvec4(1, 0, 0, 1));
    EXPECT_TRUE(std::isnan(pixelOf(hat, alongZ(2.9, 3.5, Mode::minip)).value)) << "the ray misses the voxel";
  }
  // Between 2.5 and 4.5 the field is a mean of both; what is out of the range does not pull it down.
  View view = linearView({3.1, 4.2, 30}, {3.4, 3.9, 0}, Mode::minip);
  view.channels[0].transfer = transferRamp(0, 0, 10, 0);
  view.step = 1.0 / 64;
  view.channels[0].range = DensityRange{.lo = 2, .hi = 100};
  EXPECT_NEAR(pixelOf(ramp8(), view).value, 2.5, kTolerance);
  EXPECT_LT(distance(colorOf(ramp8(), view), {0.75, 0, 0.25}), kTolerance);
  view.channels[0].range = DensityRange{.lo = 30, .hi = 50};
  EXPECT_EQ(pixelOf(ramp8(), view).color, glm::dvec4(0));
  view.channels[0].range = DensityRange{.lo = -1, .hi = 100};
  view.clip = ClipBox{.min = {-100, -100, 2.6}, .max = {100, 100, 5.2}};
  EXPECT_NEAR(pixelOf(ramp8(), view).value, 2.6, 1.0 / 64);
  view.filter = Filter::nearest;
  EXPECT_NEAR(pixelOf(ramp8(), view).value, 2.5, kTolerance);
}

// Through a constant field the first of it is shown; behind it a denser one by exp(-attenuation x n x its depth).
TEST(AnalyticAttenuatedMip, IsWhatTheFormulaSays) {
  DenseVolume volume = emptyVolume(VoxelType::u8, glm::ivec3(8));
  for (int z = 0; z < 8; ++z) {
    for (int i = 0; i < 64; ++i) volume.density[volume.at({i % 8, i / 8, z})] = z < 3 ? 200 : 80;
  }
  volume.level0_extent = Extent{.min = 80, .max = 200};
  View view = alongZ(3.3, 3.6, Mode::attenuated_mip);
  view.channels[0].transfer = transferRamp(0, 0, 200, 0);
  view.channels[0].range = DensityRange{.lo = 40, .hi = 240};
  view.filter = Filter::nearest;
  const double near = 40.0 / 200, far = 160.0 / 200;  // shares of the range
  const auto valueAt = [&](double attenuation) {
    view.attenuation = attenuation;
    return pixelOf(volume, view).value;
  };
  EXPECT_NEAR(valueAt(0), 200, kTolerance) << "the largest";
  EXPECT_NEAR(valueAt(0.1), 40 + 200 * far * std::exp(-0.1 * near * 5), 1e-9);
  EXPECT_NEAR(pixelOf(volume, view).t, 24 - 3, kTolerance);
  EXPECT_NEAR(colorOf(volume, view).b, pixelOf(volume, view).value / 200, 1e-9) << "coloured as it is shown";
  EXPECT_NEAR(valueAt(5), 80, kTolerance) << "what is behind is attenuated away";
  EXPECT_NEAR(pixelOf(volume, view).t, 24 - 8, kTolerance);
  // Samples of whatever step come to it, from the middles of their pieces; the field rises between 3.5 and 2.5.
  view.filter = Filter::linear;
  for (double step : {1.0 / 16, 1.0 / 64}) {
    view.step = step;
    const double passed = 4.5 * near + 0.5 * (near + far);  // to the ramp's end
    EXPECT_NEAR(valueAt(0.1), 40 + 200 * far * std::exp(-0.1 * passed), 200 * step) << step;
    EXPECT_NEAR(valueAt(5), 80, 200 * 5 * near * step) << step;
  }
  // Where the range is one value there is nothing to be a share of.
  view.filter = Filter::nearest;
  view.channels[0].range = DensityRange{.lo = 200, .hi = 200};
  EXPECT_NEAR(valueAt(0.1), 200, kTolerance);
}

}  // namespace
}  // namespace blockwalk::reference
