// SPDX-License-Identifier: Apache-2.0
// Frames: bands, chunks, cancelling, devices without ray queries, and every size.
#include <gtest/gtest.h>

#include "tests/renderer/compare.h"
#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"

namespace blockwalk::test {
namespace {

DeviceOptions withBands(double band_ms) {
  DeviceOptions options;
  options.band_ms = band_ms;
  return options;
}

DeviceOptions withChunks(std::uint64_t chunk_bytes) {
  DeviceOptions options;
  options.chunk_bytes = chunk_bytes;
  return options;
}

DeviceOptions withoutRayQuery() {
  DeviceOptions options;
  options.allow_ray_query = false;
  return options;
}

class FramesTest : public RendererTest {
 protected:
  static View viewOf(const VolumeInfo& info) {
    View view;
    view.width = 201;
    view.height = 150;
    view.level = 0;
    return spellOut(resolveView(view, info));
  }

  static std::unique_ptr<Renderer> other(DeviceOptions options, std::vector<std::string>& messages) {
    options.validation = true;
    options.on_message = [&messages](const std::string& text) { messages.push_back(text); };
    return createRenderer(options);
  }

  // The image of a volume of several chunks, drawn by a renderer with these options.
  static Frame drawBy(const DeviceOptions& options, const std::filesystem::path& path) {
    std::vector<std::string> messages;
    const std::unique_ptr<Renderer> renderer = other(options, messages);
    const std::unique_ptr<ResidentVolume> volume = renderer->load(VolumeFile(path));
    Frame frame = draw(*renderer, *volume, viewOf(volume->info()));
    EXPECT_EQ(messages, std::vector<std::string>{});
    return frame;
  }
};

SyntheticOptions severalMegabytes() { return {.type = VoxelType::rgba8, .dims = {150, 140, 130}, .seed = 6}; }

TEST_F(FramesTest, DoNotDependOnBands) {
  const std::filesystem::path path = buildFile(*makeSynthetic(severalMegabytes()));
  const Frame one = drawBy(withBands(1e6), path);
  const Frame many = drawBy(withBands(0.01), path);
  EXPECT_EQ(one.pixels, many.pixels);
  EXPECT_EQ(one.stats.voxel_steps, many.stats.voxel_steps);
  EXPECT_EQ(one.stats.block_visits, many.stats.block_visits);
}

// However cheap the frames before were: what is not known of a volume and a kernel begins with one row of workgroups,
// and grows by four. What is known is cut by it.
TEST_F(FramesTest, TheFirstOfAVolumeAndAKernelBeginsSmall) {
  DeviceOptions options = withBands(1e6);
  int submissions = 0;
  options.inject_fault = [&submissions](DeviceCall call) {
    submissions += call == DeviceCall::submit ? 1 : 0;
    return DeviceFault::none;
  };
  std::vector<std::string> messages;
  const std::unique_ptr<Renderer> renderer = other(options, messages);
  const std::unique_ptr<ResidentVolume> one = renderer->load(VolumeFile(buildFile(*makeSynthetic({}))));
  const std::unique_ptr<ResidentVolume> two = renderer->load(VolumeFile(buildFile(*makeSynthetic({.seed = 2}))));
  const auto bands = [&](ResidentVolume& volume, const View& view) {
    renderer->render(volume, view, {.prepare_only = true});
    submissions = 0;
    renderer->render(volume, view);
    return submissions;
  };
  View view = viewOf(one->info());
  view.width = 64;
  view.height = 512;
  view.finder = Finder::grid;   // another may be tried by frames of its own
  constexpr int kFromARow = 4;  // 8, 32, 128 and 344 rows
  EXPECT_EQ(bands(*one, view), kFromARow);
  EXPECT_EQ(bands(*one, view), 1);
  EXPECT_EQ(bands(*two, view), kFromARow) << "another volume";
  view.mode = Mode::mip;
  EXPECT_EQ(bands(*one, view), kFromARow) << "another kernel";
  EXPECT_EQ(bands(*one, view), 1);
  EXPECT_EQ(messages, std::vector<std::string>{});
}

TEST_F(FramesTest, DoNotDependOnChunks) {
  const std::filesystem::path path = buildFile(*makeSynthetic(severalMegabytes()));
  ASSERT_GT(VolumeFile(path).info().levels[0].voxel_bytes, std::uint64_t{3} << 20);
  const Frame one = drawBy(withChunks(std::uint64_t{256} << 20), path);
  const Frame many = drawBy(withChunks(std::uint64_t{1} << 20), path);
  EXPECT_EQ(one.pixels, many.pixels);
}

TEST_F(FramesTest, ACancelledFrameStops) {
  Scene scene = makeScene(*makeSynthetic(severalMegabytes()));
  View view = viewOf(scene.info);
  view.width = view.height = 2048;
  const auto cancel = std::make_shared<std::atomic<bool>>(true);
  const Frame frame = renderer().render(*scene.resident, view, {.cancel = cancel});
  EXPECT_TRUE(frame.cancelled);
  // The next frame is whole again.
  const View small = viewOf(scene.info);
  const Frame whole = draw(scene, small);
  EXPECT_EQ(whole.pixels, draw(scene, small).pixels);
}

TEST_F(FramesTest, WithoutRayQueriesTheGridServesAndSaysSoOnce) {
  const std::filesystem::path path = buildFile(*makeSynthetic({}));
  std::vector<std::string> messages;
  const std::unique_ptr<Renderer> hidden = other(withoutRayQuery(), messages);
  const std::unique_ptr<ResidentVolume> volume = hidden->load(VolumeFile(path));
  EXPECT_FALSE(hidden->device().ray_query);
  View view = viewOf(volume->info());
  const Frame frame = draw(*hidden, *volume, view);
  EXPECT_EQ(frame.stats.finder, "grid");
  draw(*hidden, *volume, view);
  EXPECT_EQ(messages.size(), 1u) << ::testing::PrintToString(messages);
  view.finder = Finder::query;
  try {
    hidden->render(*volume, view, {});
    ADD_FAILURE() << "a query without ray queries was drawn";
  } catch (const ViewError& error) {
    EXPECT_EQ(error.field, "finder");
  }
  Scene shown = makeScene(*makeSynthetic({}));
  EXPECT_LE(compareImages(frame, draw(shown, viewOf(shown.info))).largest, 1);
}

TEST_F(FramesTest, ExtremeSizesAreDrawn) {
  Scene scene = makeScene(*makeSynthetic({.dims = {40, 40, 40}}));
  for (const auto& [width, height] : {std::pair{1, 1}, {8192, 1}, {1, 8192}, {8191, 3}, {7, 8}, {9, 9}}) {
    View view = viewOf(scene.info);
    view.width = width;
    view.height = height;
    const ImageError error =
        compareToReference(draw(scene, view), reference::renderImage(scene.dense(0), view), view.background);
    EXPECT_LE(error.largest, 2) << width << 'x' << height << ": " << error.worst;
  }
}

TEST_F(FramesTest, AVolumeWithoutVoxelsShowsTheBackground) {
  BuildOptions all_empty;
  all_empty.empty_thresholds = {255};
  Scene scene = makeScene(*makeSynthetic({.dims = {5, 4, 3}, .seed = 9}), all_empty);
  ASSERT_EQ(scene.info.channels[0].nonempty_voxels, 0u);
  for (const Combination& combination : allCombinations()) {
    for (Mode mode : {Mode::blend, Mode::first_hit, Mode::blocks}) {
      View view = viewOf(scene.info);
      view.mode = mode;
      view.background = {10, 20, 30, 255};
      const Frame frame = draw(scene, with(view, combination));
      const std::vector<std::uint32_t> background(frame.pixels.size(), 0xff1e140au);
      EXPECT_EQ(frame.pixels, background) << toString(combination);
    }
  }
}

}  // namespace
}  // namespace blockwalk::test
