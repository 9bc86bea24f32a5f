// SPDX-License-Identifier: Apache-2.0
// Frames that are drawn of several levels: of coarser ones what is farther away.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "tests/renderer/compare.h"
#include "tests/renderer/pages_stage.h"
#include "tests/renderer/synthetic.h"

namespace blockwalk::test {
namespace {

// Along z far longer than wide: seen from its end three levels, and of maxima too.
constexpr glm::ivec3 kLong{48, 44, 420};

// Of one density everywhere, which all levels have.
class Even final : public Source {
 public:
  Even() {
    info_.name = "even";
    info_.format = "test";
    info_.dims = kLong;
    info_.random_access = true;
  }
  const SourceInfo& info() const override { return info_; }
  void readRows(int /*z*/, int /*y*/, int /*count*/, std::span<std::byte> out) override {
    std::ranges::fill(out, std::byte{200});
  }

 private:
  SourceInfo info_;
};

class LevelsTest : public PagesTest {
 protected:
  static Scene longScene(VoxelType type, int channels = 1) {
    return makeScene(*makeSynthetic({.type = type, .dims = kLong, .seed = 21, .channels = channels}), kSmallBlocks);
  }

  static Scene evenScene() {
    Even source;
    return makeScene(source, kSmallBlocks);
  }

  static View alongView(const VolumeInfo& info) {
    View view;
    view.width = view.height = 48;
    view.fov_degrees = 60;
    view.eye = glm::dvec3(20.3, 25.1, 425);
    view.target = glm::dvec3(24.9, 21.7, 0);
    if (info.type == VoxelType::rgba8) return view;
    for (std::size_t i = 0; i < info.channels.size(); ++i) {
      const double least = info.channels[i].dataFromStored(info.channels[i].density_min);
      const double most = info.channels[i].dataFromStored(info.channels[i].density_max);
      view.channels[i].transfer = {{.value = least, .color = {0.2, 0.4, 1}, .opacity = 0.002},
                                   {.value = most, .color = {1, 0.7, 0.3}, .opacity = 0.05}};
    }
    return view;
  }

  static View resolved(const View& view, const VolumeInfo& info) { return spellOut(resolveView(view, info)); }

  // Mode mip has no level 1.
  static std::vector<reference::DenseVolume> levelsOf(const Scene& scene, Mode mode, int count) {
    std::vector<reference::DenseVolume> levels;
    const VolumeFile file(scene.path);
    for (int level = 0; level < count; ++level) {
      if (mode == Mode::mip && level == 1) continue;
      const bool maxima = mode == Mode::mip && level > 0;
      levels.push_back(reference::volumeFromFile(file, level, 0, maxima ? Form::maxima : Form::values));
    }
    return levels;
  }
};

TEST_F(LevelsTest, AreThoseOfTheReference) {
  for (const VoxelType type : {VoxelType::u8, VoxelType::u16, VoxelType::f32, VoxelType::rgba8}) {
    Scene scene = longScene(type);
    ImageError all;
    for (const Mode mode : {Mode::blend, Mode::first_hit, Mode::mip, Mode::mean}) {
      for (const Filter filter : {Filter::nearest, Filter::linear}) {
        for (const double lod : {1.0, 2.0}) {
          View view = alongView(scene.info);
          view.mode = mode;
          view.filter = filter;
          view.lod = lod;
          view.finder = Finder::grid;
          view = resolved(view, scene.info);
          SCOPED_TRACE(toString(view));
          const Frame frame = draw(scene, view);
          EXPECT_EQ(frame.stats.level, 0);
          EXPECT_GE(frame.stats.far_level, 2);
          const auto levels = levelsOf(scene, mode, frame.stats.far_level + 1);
          const ImageError error = compareToReference(frame, reference::renderLevels(levels, view), view.background, 0);
          all.add(error);
          // A ray in first-hit and mip may meet another voxel by rounding alone.
          const bool jumps = mode == Mode::first_hit || mode == Mode::mip;
          EXPECT_LE(error.largest, jumps ? 255 : kLargestError) << error.worst;
          EXPECT_GE(error.psnr(), jumps ? 40 : kLeastPsnr) << error.worst;
          EXPECT_GT(error.drawn, 200u);
        }
      }
    }
  }
}

// Light, pieces between two densities, surfaces and cuts are of the level of each part.
TEST_F(LevelsTest, LightCutsAndSurfacesAreThoseOfTheReference) {
  const glm::dmat4 map = glm::dmat4(glm::dmat3(1, 0, 0, 0, 1.2, 0, 0, 0, 1.1));
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::u8, .dims = kLong, .seed = 21, .world_from_index = map}),
                          kSmallBlocks);
  const auto holds = [&](auto change, double psnr) {
    View view = alongView(scene.info);
    view.eye = glm::dvec3(20.3, 29.1, 470);
    view.filter = Filter::linear;
    view.lod = 1;
    view.finder = Finder::grid;
    change(view);
    view = resolved(view, scene.info);
    SCOPED_TRACE(toString(view));
    const Frame frame = draw(scene, view);
    EXPECT_GE(frame.stats.far_level, 2);
    const auto levels = levelsOf(scene, view.mode, frame.stats.far_level + 1);
    const ImageError error = compareToReference(frame, reference::renderLevels(levels, view), view.background, 0);
    EXPECT_GE(error.psnr(), psnr) << error.worst;
    EXPECT_GT(error.drawn, 200u);
  };
  holds([](View& view) { view.lit = true; }, kLeastPsnr);
  holds([](View& view) { view.classification = Classification::pre_integrated; }, kLeastPsnr);
  holds([](View& view) { view.planes = {{.normal = {0.3, 1, 0.05}, .offset = -28}}; }, kLeastPsnr);
  holds([](View& view) { view.filter = Filter::nearest; }, kLeastPsnr);
  holds([](View& view) { view.mode = Mode::iso; }, 40);
}

// Not by the way to it: finders, walking and culling only skip what shows nothing.
TEST_F(LevelsTest, AreTheSameHoweverTheyAreFound) {
  Scene scene = longScene(VoxelType::u8);
  for (const Filter filter : {Filter::nearest, Filter::linear}) {
    for (const Mode mode : {Mode::blend, Mode::first_hit, Mode::mip}) {
      View view = alongView(scene.info);
      view.mode = mode;
      view.filter = filter;
      const double least = scene.info.channels[0].dataFromStored(scene.info.channels[0].density_min);
      const double most = scene.info.channels[0].dataFromStored(scene.info.channels[0].density_max);
      view.channels[0].range = DensityRange{.lo = least + 0.4 * (most - least), .hi = least + 0.8 * (most - least)};
      std::optional<Frame> first;
      for (const Combination& combination : mode == Mode::blend ? allCombinations() : everyFinder()) {
        SCOPED_TRACE(toString(with(view, combination)));
        FrameOrder order{.view = resolveView(with(view, combination), scene.info)};
        order.general = true;
        Frame frame = renderer().render(*scene.resident, order);
        EXPECT_GT(frame.stats.far_level, frame.stats.level);
        EXPECT_EQ(frame.stats.loop_bound_hits, 0u);
        if (!first) first = frame;
        EXPECT_LE(compareImages(frame, *first).largest, 1) << compareImages(frame, *first).worst;
      }
    }
  }
}

TEST_F(LevelsTest, SpecialAndGeneralKernelsDrawTheSame) {
  Scene scene = longScene(VoxelType::u16, 2);
  View view = alongView(scene.info);
  view.filter = Filter::linear;
  view.samples = 3;
  for (const Output output : {Output::color, Output::mesh}) {
    view.output = output;
    FrameOrder order{.view = resolveView(view, scene.info)};
    const Frame special = renderer().render(*scene.resident, order);
    order.general = true;
    const Frame general = renderer().render(*scene.resident, order);
    EXPECT_GT(special.stats.far_level, 1);
    EXPECT_EQ(special.pixels, general.pixels);
  }
}

// Each level comes and goes, or is there, as it finds room.
TEST_F(LevelsTest, WhatIsPagedIsThatOfAllVoxels) {
  Scene scene = longScene(VoxelType::u8);
  std::uint64_t read = 0;
  for (const std::uint64_t room : {192 * kKib, 256 * kKib, 320 * kKib}) {
    start(scene.path, room);
    int whole = 0;
    for (const Mode mode : {Mode::blend, Mode::first_hit, Mode::iso, Mode::mip, Mode::mean}) {
      for (const Filter filter : {Filter::nearest, Filter::linear}) {
        for (const Output output : {Output::color, Output::depth}) {
          if (output == Output::depth && mode == Mode::mean) continue;
          View view = alongView(scene.info);
          view.width = view.height = 40;
          view.mode = mode;
          view.filter = filter;
          view.output = output;
          view.lod = 1;
          SCOPED_TRACE(toString(view));
          FrameOrder order = orderOf(view);
          order.general = true;
          const Frame expected = renderer().render(*scene.resident, order);
          const Frame frame = renderer_->render(*volume_, order);
          EXPECT_GT(expected.stats.far_level, 1);
          EXPECT_FALSE(expected.stats.paged);
          read += frame.stats.pages_read;
          EXPECT_TRUE(frame.stats.paged);
          if (frame.stats.absent_blocks > 0) continue;  // along one workgroup's rays lies more
          EXPECT_EQ(frame.pixels, expected.pixels);
          EXPECT_EQ(frame.values, expected.values);
          ++whole;
        }
      }
    }
    EXPECT_GT(whole, 5);
  }
  EXPECT_GT(read, scene.info.levels[0].block_count);
}

// Farther away there is less to do, and to hold.
TEST_F(LevelsTest, FarPartsTakeFewerStepsAndPages) {
  const Scene scene = evenScene();
  start(scene.path, 1024 * kKib);
  View view = alongView(scene.info);
  view.width = view.height = 8;
  view.fov_degrees = 8;
  view.filter = Filter::linear;
  view.channels[0].transfer = {{.value = 0, .color = {1, 1, 1}, .opacity = 0.001}};
  const auto drawn = [&](double lod) {
    view.lod = lod;
    FrameOrder order = orderOf(view);
    order.count = true;
    return renderer_->render(*volume_, order).stats;
  };
  const RenderStats one = drawn(kOneLevel);
  const RenderStats several = drawn(1);
  EXPECT_EQ(one.far_level, 0);
  EXPECT_GT(several.far_level, 1);
  EXPECT_LT(several.voxel_steps, 0.6 * static_cast<double>(one.voxel_steps));
  start(scene.path, 1024 * kKib);
  const std::uint64_t pages = drawn(1).pages_read;
  start(scene.path, 1024 * kKib);
  EXPECT_LT(2 * pages, drawn(kOneLevel).pages_read);
}

// What lies behind an opacity is coarser, whoever finds it; and where nothing is opaque nothing is.
TEST_F(LevelsTest, BehindAnOpacityIsCoarserHoweverItIsFound) {
  Scene scene = longScene(VoxelType::u8);
  View view = alongView(scene.info);
  view.lod = kMaxLod;  // of distance nothing is
  for (const Filter filter : {Filter::nearest, Filter::linear}) {
    view.filter = filter;
    view.lod_alpha = 0;
    const Frame whole = draw(scene, view);
    EXPECT_EQ(whole.stats.far_level, 0);
    view.lod_alpha = 1;
    std::optional<Frame> first;
    for (const Combination& combination : everyFinder()) {
      SCOPED_TRACE(toString(with(view, combination)));
      FrameOrder order{.view = resolveView(with(view, combination), scene.info)};
      order.general = true;
      const Frame frame = renderer().render(*scene.resident, order);
      EXPECT_GT(frame.stats.far_level, 1);
      EXPECT_EQ(frame.stats.loop_bound_hits, 0u);
      if (!first) first = frame;
      // By rounding a ray may cross one block more before it is coarser.
      EXPECT_GT(compareImages(frame, *first).psnr(), 60) << compareImages(frame, *first).worst;
    }
    EXPECT_GT(compareImages(*first, whole).largest, 1) << "it is another picture";
    EXPECT_GT(compareImages(*first, whole).psnr(), 25);
  }
  View solid = view;
  const Scene even = evenScene();
  solid.channels[0].transfer = {{.value = 0, .color = {1, 0.8, 0.6}, .opacity = 0.02}};
  solid.filter = Filter::linear;
  const Frame coarser = renderer().render(*even.resident, solid);
  solid.lod_alpha = 0;
  const Frame whole = renderer().render(*even.resident, solid);
  EXPECT_GT(coarser.stats.far_level, 1);
  EXPECT_LE(compareImages(coarser, whole).largest, 1) << compareImages(coarser, whole).worst;
}

// Where one ends and the next begins nothing is to be seen.
TEST_F(LevelsTest, BordersOfLevelsAreNeitherGapsNorSeams) {
  Scene scene = evenScene();
  View view = alongView(scene.info);
  view.channels[0].transfer = {{.value = 0, .color = {1, 0.8, 0.6}, .opacity = 0.004}};
  for (const Filter filter : {Filter::nearest, Filter::linear}) {
    for (const Mode mode : {Mode::blend, Mode::mean, Mode::first_hit}) {
      view.filter = filter;
      view.mode = mode;
      SCOPED_TRACE(toString(view));
      view.lod = kOneLevel;
      const Frame one = draw(scene, view);
      view.lod = 1;
      const Frame several = draw(scene, view);
      EXPECT_GT(several.stats.far_level, 1);
      const ImageError error = compareImages(several, one);
      EXPECT_LE(error.largest, 1) << error.worst;
      EXPECT_GT(std::ranges::count_if(one.pixels, [](std::uint32_t pixel) { return pixel != 0xff000000; }), 1000);
    }
  }
}

}  // namespace
}  // namespace blockwalk::test
