// SPDX-License-Identifier: Apache-2.0
// A maximum along rays stays one on coarse levels, and a minimum is none of their means.
#include <algorithm>

#include "tests/reference/reference.h"
#include "tests/renderer/compare.h"
#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"
#include "view/resolved_view.h"

namespace blockwalk::test {
namespace {

// A haze of 20 in one corner, two lines of 255 that are a voxel thin, and a voxel of 240 alone.
class ThinSource final : public Source {
 public:
  explicit ThinSource(VoxelType type) {
    info_.name = "thin";
    info_.format = "test";
    info_.type = type;
    info_.dims = glm::ivec3(256);
    info_.random_access = true;
  }
  const SourceInfo& info() const override { return info_; }
  void readRows(int z, int y, int count, std::span<std::byte> out) override {
    const std::size_t bytes = voxelBytes(info_.type);
    for (int row = 0; row < count; ++row) {
      for (int x = 0; x < info_.dims.x; ++x) {
        const std::uint32_t voxel = voxelAt({x, y + row, z});
        std::memcpy(out.data() + static_cast<std::size_t>(row * info_.dims.x + x) * bytes, &voxel, bytes);
      }
    }
  }

 private:
  std::uint32_t voxelAt(glm::ivec3 p) const {
    std::uint32_t density = p.x < 90 && p.y < 70 && p.z < 50 ? 20 : 0;
    if ((p.x == 130 && p.y == 77) || (p.y == 201 && p.z == 31)) density = 255;
    if (p == glm::ivec3(220, 40, 170)) density = 240;
    if (info_.type == VoxelType::rgba8 && density > 0) return density << 24 | density << 8 | 255;
    return density;
  }
  SourceInfo info_;
};

View thinView(int side) {
  View view;
  view.width = view.height = side;
  view.mode = Mode::mip;
  view.channels[0].range = DensityRange{.lo = 1, .hi = 255};
  return view;
}

int greatestChannel(const Frame& frame, int shift) {
  int most = 0;
  for (const std::uint32_t pixel : frame.pixels) most = std::max(most, static_cast<int>(pixel >> shift & 255));
  return most;
}

class MaximaTest : public RendererTest {};

TEST_F(MaximaTest, WhatIsAVoxelThinIsSeenOnEveryLevel) {
  ThinSource source(VoxelType::u8);
  Scene scene = makeScene(source);
  ASSERT_GE(scene.info.levels.size(), 4u);
  for (const int side : {128, 64, 32, 16}) {
    View view = thinView(side);
    view.channels[0].transfer = {{.value = 0, .color = glm::dvec3(0), .opacity = 1},
                                 {.value = 255, .color = glm::dvec3(1), .opacity = 1}};
    const Frame whole = draw(scene, view);
    EXPECT_EQ(greatestChannel(whole, 0), 255) << side << " level " << whole.stats.level;
    if (side < 64) continue;  // a pixel is wider than a voxel of the coarsest level
    // Alone in the picture, the voxel too: some ray meets the voxel of the level that covers it.
    view.channels[0].range = DensityRange{.lo = 230, .hi = 250};
    EXPECT_EQ(greatestChannel(draw(scene, view), 0), 240) << side << " level " << whole.stats.level;
  }
}

TEST_F(MaximaTest, TheReferenceSaysTheSame) {
  for (const VoxelType type : {VoxelType::u8, VoxelType::rgba8}) {
    ThinSource source(type);
    Scene scene = makeScene(source);
    for (int level = kFirstMaximaLevel; level < static_cast<int>(scene.info.levels.size()); ++level) {
      const reference::DenseVolume dense = reference::volumeFromFile(VolumeFile(scene.path), level, 0, Form::maxima);
      for (const Filter filter : {Filter::nearest, Filter::linear}) {
        View view = thinView(48);
        view.level = level;
        view.filter = filter;
        view = spellOut(resolveView(view, scene.info));
        const reference::Image expected = reference::renderImage(dense, view);
        for (const Combination& choice : combinations()) {
          const ImageError error = compareToReference(draw(scene, with(view, choice)), expected, view.background);
          EXPECT_LE(error.largest, kLargestError)
              << toString(choice) << ": " << error.worst << "\n  view " << toString(view);
          EXPECT_GT(error.drawn, 20u);
        }
      }
    }
  }
}

// A plate of 200 with holes of 0 and lines of 120 in it, so that every coarser voxel is a mean of several.
std::unique_ptr<Source> plate() {
  return makeVoxels({128, 128, 24}, [](glm::ivec3 p) {
    const int number = p.x + 3 * p.y + 5 * p.z;
    return number % 7 == 0 ? 0 : number % 4 == 1 ? 120 : 200;
  });
}

// However far away, and whatever level is asked for, no value is seen that no voxel has.
TEST_F(MaximaTest, AMinimumIsOfVoxelsThatAreThere) {
  Scene scene = makeScene(*plate());
  ASSERT_GE(scene.info.levels.size(), 3u);
  for (const Mode mode : {Mode::minip, Mode::attenuated_mip}) {
    for (const int level : {kAutoLevel, 1, 2}) {
      for (const Filter filter : {Filter::nearest, Filter::linear}) {
        View view;
        view.width = view.height = 24;
        view.mode = mode;
        view.filter = filter;
        view.level = level;
        view.attenuation = 0;
        view.output = Output::value;
        const Frame frame = draw(scene, view);
        EXPECT_EQ(frame.stats.level, 0);
        EXPECT_EQ(frame.stats.far_level, 0);
        std::size_t seen = 0;
        for (const float value : frame.values) {
          if (std::isnan(value)) continue;
          ++seen;
          EXPECT_GE(value, mode == Mode::minip ? 120 : 0) << "what is empty has no say";
          if (filter == Filter::linear) continue;
          EXPECT_LT(std::min(std::abs(value - 120), std::abs(value - 200)), 1e-3f);
        }
        EXPECT_GT(seen, 100u);
      }
    }
  }
}

}  // namespace
}  // namespace blockwalk::test
