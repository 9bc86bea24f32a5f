// SPDX-License-Identifier: Apache-2.0
// Pictures of small files of what users of other programs met, against what is right there.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "tests/renderer/stage.h"
#include "volume/import/import.h"

namespace blockwalk::test {
namespace {

class PictureCases : public RendererTest {
 protected:
  // Environment BLOCKWALK_CASES, else ../shared/cases beside the sources; nothing where it is not there.
  static std::optional<Scene> open(const std::string& file) {
    const char* named = std::getenv("BLOCKWALK_CASES");
    const std::filesystem::path folder = named != nullptr ? named : BLOCKWALK_SOURCE_DIR "/../shared/cases";
    if (!std::filesystem::exists(folder / file)) return std::nullopt;
    return makeScene(*openSource({folder / file}, {}), {.values = ValuesRule::guess});
  }
  static int red(std::uint32_t pixel) { return static_cast<int>(pixel & 255); }
  static int green(std::uint32_t pixel) { return static_cast<int>(pixel >> 8 & 255); }
  static int blue(std::uint32_t pixel) { return static_cast<int>(pixel >> 16 & 255); }
};

TransferPoint point(double value, glm::dvec3 color, double opacity) {
  return {.value = value, .color = color, .opacity = opacity};
}

// Labels 2 and 10 alone: what lies between them is never seen, on no level.
TEST_F(PictureCases, LabelsStayLabelsOnCoarseLevels) {
  auto scene = open("label_levels/labels96.nrrd");
  if (!scene) GTEST_SKIP() << "label_levels/labels96.nrrd is not there";
  EXPECT_EQ(scene->info.channels[0].values, ChannelValues::labels);
  View view;
  view.width = 48;
  view.height = 36;
  view.mode = Mode::first_hit;
  view.channels[0].transfer = {point(2, {1, 0, 0}, 1), point(3, {0, 1, 0}, 1), point(10, {0, 0, 1}, 1)};
  view.transfer_shape = TransferShape::stepped;
  for (const int level : {kAutoLevel, 0, 1}) {
    view.level = level;
    int shown = 0;
    for (const std::uint32_t pixel : draw(*scene, view).pixels) {
      EXPECT_FALSE(green(pixel) > 128 && red(pixel) < 128 && blue(pixel) < 128);
      shown += red(pixel) + blue(pixel) > 128 ? 1 : 0;
    }
    EXPECT_GT(shown, 400) << level;
  }
}

// Lines one voxel thin.
TEST_F(PictureCases, AMaximumStaysOneOnCoarseLevels) {
  auto scene = open("mip_levels/line.nrrd");
  if (!scene) GTEST_SKIP() << "mip_levels/line.nrrd is not there";
  View view;
  view.width = view.height = 64;
  view.mode = Mode::mip;
  view.channels[0].range = DensityRange{.lo = 1, .hi = 255};
  view.channels[0].transfer = {point(0, glm::dvec3(0), 1), point(255, glm::dvec3(1), 1)};
  int most = 0;
  for (const std::uint32_t pixel : draw(*scene, view).pixels) most = std::max(most, red(pixel));
  EXPECT_EQ(most, 255);
}

// One voxel of 65535 beside densities of 20 takes no light away.
TEST_F(PictureCases, LightDoesNotGoByTheHottestVoxel) {
  double difference[2] = {};
  const char* files[] = {"lit_hot_voxel/nohot.nrrd", "lit_hot_voxel/hotpixel_u16.nrrd"};
  for (int i = 0; i < 2; ++i) {
    auto scene = open(files[i]);
    if (!scene) GTEST_SKIP() << files[i] << " is not there";
    View view;
    view.width = 200;
    view.height = 150;
    view.filter = Filter::linear;
    // The hot voxel would be framed too.
    const WorldBox box = worldBox(scene->info);
    view.target = 0.5 * (box.min + box.max);
    view.eye = *view.target + 1.5 * (box.max - box.min);
    view.channels[0].transfer = {point(10, {0.75, 0.5, 0.25}, 0), point(20, {1, 0.875, 0.75}, 0.8)};
    view.channels[0].range = DensityRange{.lo = 5, .hi = 100};
    const Frame unlit = draw(*scene, view);
    view.lit = true;
    const Frame lit = draw(*scene, view);
    for (std::size_t at = 0; at < lit.pixels.size(); ++at) {
      difference[i] += std::abs(red(lit.pixels[at]) - red(unlit.pixels[at]));
    }
  }
  EXPECT_GT(difference[0], 10000) << "light is seen";
  EXPECT_GT(difference[1], 0.8 * difference[0]);
  EXPECT_LT(difference[1], 1.25 * difference[0]);
}

}  // namespace
}  // namespace blockwalk::test
