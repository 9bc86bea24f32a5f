// SPDX-License-Identifier: Apache-2.0
// Volumes of several channels (docs/integration.md, Channels): against the float64 reference, against themselves with
// one channel, every finder, walk and cull against each other, and what becomes resident.
#include <algorithm>
#include <string_view>

#include "tests/renderer/compare.h"
#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"
#include "tests/renderer/views.h"

namespace blockwalk::test {
namespace {

constexpr int kLargestChannelsError = 1;  // 8-bit steps

struct Look {
  std::string_view name;
  Mode mode = Mode::blend;
  Filter filter = Filter::linear;
  bool lit = false;
  Classification classification = Classification::post;
};

constexpr Look kLooks[] = {
    {.name = "blend lit", .lit = true},
    {.name = "pre-integrated", .classification = Classification::pre_integrated},
    {.name = "first-hit lit", .mode = Mode::first_hit, .lit = true},
    {.name = "mip", .mode = Mode::mip},
    {.name = "nearest blend", .filter = Filter::nearest},
    {.name = "nearest first-hit lit", .mode = Mode::first_hit, .filter = Filter::nearest, .lit = true},
    {.name = "nearest mip", .mode = Mode::mip, .filter = Filter::nearest},
    {.name = "minip", .mode = Mode::minip},
    {.name = "nearest minip", .mode = Mode::minip, .filter = Filter::nearest},
    {.name = "attenuated-mip", .mode = Mode::attenuated_mip},
    {.name = "nearest attenuated-mip", .mode = Mode::attenuated_mip, .filter = Filter::nearest},
    {.name = "nearest mean", .mode = Mode::mean, .filter = Filter::nearest},
};

View lookAt(View view, const Look& look) {
  view.mode = look.mode;
  view.filter = look.filter;
  view.lit = look.lit;
  view.classification = look.classification;
  return view;
}

std::vector<reference::DenseVolume> drawnOf(const Scene& scene, const View& view) {
  std::vector<reference::DenseVolume> drawn;
  for (int channel : view.drawn) drawn.push_back(scene.dense(view.level, static_cast<std::size_t>(channel)));
  return drawn;
}

SyntheticOptions threeFields() {
  return {.type = VoxelType::u16,
          .dims = {61, 100, 49},
          .seed = 3,
          .world_from_index = obliqueMap(false),
          .channels = 3,
          .first_channel = 0};
}

// Two ordinary views: one with every range open, one with some of them narrowed.
std::vector<View> twoViews(const Scene& scene) {
  const std::vector<View> all = randomViews(scene.info, scene.dense(0), 21);
  std::vector<View> views{all[1], all[10]};
  for (std::size_t c = 1; c < scene.info.channels.size(); c += 2) {
    DensityRange& range = views[1].channels[c].range.value();
    range = {.lo = range.lo + 0.2 * (range.hi - range.lo), .hi = range.lo + 0.7 * (range.hi - range.lo)};
  }
  return views;
}

std::size_t litPixels(const Frame& frame) {
  return static_cast<std::size_t>(
      std::ranges::count_if(frame.pixels, [](std::uint32_t pixel) { return (pixel & 0xffffff) != 0; }));
}

class ChannelsTest : public RendererTest, public ::testing::WithParamInterface<SyntheticOptions> {};

TEST_P(ChannelsTest, AreDrawnAsTheReferenceDraws) {
  Scene scene = makeScene(*makeSynthetic(GetParam()));
  ASSERT_EQ(scene.info.channels.size(), static_cast<std::size_t>(GetParam().channels));
  for (const Look& look : kLooks) {
    ImageError total;
    for (const View& base : twoViews(scene)) {
      const View view = lookAt(base, look);
      const reference::Image expected = reference::renderImage(drawnOf(scene, view), view);
      const double near_jump = look.filter == Filter::linear ? kNearJump : 0;
      const ImageError error = compareToReference(draw(scene, view), expected, view.background, near_jump);
      EXPECT_LE(error.largest, kLargestChannelsError)
          << look.name << ": " << error.worst << "\n  view " << toString(view);
      total.add(error);
    }
    EXPECT_GT(total.drawn, 1000u) << look.name;
    EXPECT_LE(total.skipped * 8, total.channels) << look.name << ": too many samples at jumps to say anything";
    std::printf("%s: largest error %d, PSNR %.1f dB, %zu skipped\n", look.name.data(), total.largest, total.psnr(),
                total.skipped);
  }
}

std::string channelsName(const ::testing::TestParamInfo<SyntheticOptions>& info) {
  return std::string(voxelTypeName(info.param.type)) + "_" + std::to_string(info.param.channels);
}

INSTANTIATE_TEST_SUITE_P(Of, ChannelsTest,
                         ::testing::Values(SyntheticOptions{.type = VoxelType::u8,
                                                            .dims = {70, 64, 57},
                                                            .seed = 2,
                                                            .world_from_index = glm::dmat4(1),
                                                            .channels = 2,
                                                            .first_channel = 0},
                                           threeFields(),
                                           SyntheticOptions{.type = VoxelType::f32,
                                                            .dims = {64, 51, 96},
                                                            .seed = 4,
                                                            .world_from_index = obliqueMap(true),
                                                            .channels = 2,
                                                            .first_channel = 0}),
                         channelsName);

class ThreeChannels : public RendererTest {
 protected:
  Scene scene_ = makeScene(*makeSynthetic(threeFields()));
};

TEST_F(ThreeChannels, AreTheSameForEveryFinderWalkAndCull) {
  const std::vector<Combination> all = everyFinder();
  for (const Look& look : {kLooks[2], kLooks[4]}) {
    const View view = lookAt(twoViews(scene_)[1], look);
    const Frame first = draw(scene_, with(view, all.front()));
    EXPECT_GT(litPixels(first), 500u);
    for (std::size_t i = 1; i < all.size(); ++i) {
      const ImageError error = compareImages(draw(scene_, with(view, all[i])), first);
      EXPECT_LE(error.largest, 1) << look.name << ": " << toString(all[i]) << " against " << toString(all.front())
                                  << ": " << error.worst;
    }
  }
}

// A voxel of these volumes is in the same place, and has the same value, in the volume of its channel alone.
TEST_F(ThreeChannels, OfWhichOneIsDrawnShowThatFieldAlone) {
  for (int channel : {0, 2}) {
    SyntheticOptions options = threeFields();
    options.channels = 1;
    options.first_channel = channel;
    Scene alone = makeScene(*makeSynthetic(options));
    for (const Look& look : {kLooks[0], kLooks[4]}) {
      View view = lookAt(twoViews(scene_)[1], look);
      view.drawn = {channel};
      const Frame of_three = draw(scene_, view);
      EXPECT_GT(litPixels(of_three), 500u);
      view.drawn = {0};
      std::swap(view.channels[0], view.channels[static_cast<std::size_t>(channel)]);
      for (std::size_t i = 1; i < kMaxChannels; ++i) view.channels[i] = {};
      EXPECT_EQ(draw(alone, view).pixels, of_three.pixels) << look.name << " of channel " << channel;
    }
  }
}

TEST_F(ThreeChannels, AreDrawnInAnyOrder) {
  View view = lookAt(twoViews(scene_)[0], kLooks[4]);
  view.drawn = {0, 2};
  const Frame forward = draw(scene_, view);
  view.drawn = {2, 0};
  EXPECT_EQ(draw(scene_, view).pixels, forward.pixels);
  view.drawn = {0};
  EXPECT_NE(draw(scene_, view).pixels, forward.pixels);
}

TEST_F(ThreeChannels, ShowTheSurfaceOfTheFirstDrawn) {
  View view = twoViews(scene_)[0];
  view.mode = Mode::iso;
  view.filter = Filter::nearest;
  view.drawn = {1, 2};
  view.iso = view.channels[1].range->lo;
  const Frame both = draw(scene_, view);
  EXPECT_GT(litPixels(both), 500u);
  view.drawn = {1};
  EXPECT_EQ(draw(scene_, view).pixels, both.pixels);
}

TEST_F(ThreeChannels, CountTheBlocksOfAnyOfThem) {
  View view = twoViews(scene_)[1];
  view.mode = Mode::blocks;
  for (const std::vector<int>& drawn : {std::vector<int>{0, 1, 2}, {1, 2}, {2}}) {
    view.drawn = drawn;
    const reference::Image expected = reference::renderImage(drawnOf(scene_, view), view);
    for (bool cull : {true, false}) {
      view.cull = cull;
      const ProbeError error = compareBlocks(draw(scene_, view), expected);
      EXPECT_EQ(error.unexcused, 0u) << error.worst;
      EXPECT_GT(error.met, 500u);
    }
  }
}

TEST_F(ThreeChannels, AreResidentWhenTheyAreDrawn) {
  VolumeFile file(buildFile(*makeSynthetic(threeFields())));
  const std::uint64_t voxels = file.info().levels[0].voxel_bytes;
  View view = twoViews(scene_)[0];
  view.mode = Mode::blend;
  const std::unique_ptr<Renderer> fresh = createRenderer({});
  const std::unique_ptr<ResidentVolume> volume = fresh->load(std::move(file));
  const auto bytesAfter = [&](std::vector<int> drawn, Filter filter) {
    view.drawn = std::move(drawn);
    view.filter = filter;
    draw(*fresh, *volume, view);
    return volume->deviceBytes();
  };
  const auto voxelBytes = [&] {
    std::uint64_t bytes = 0;
    for (const ResidentPart& part : volume->parts()) bytes += part.what == "voxels" ? part.bytes : 0;
    return bytes;
  };
  EXPECT_EQ(volume->deviceBytes(), 0u);
  fresh->render(*volume, View{}, {.prepare_only = true});
  const std::uint64_t loaded = voxelBytes();  // what a default view shows: all channels, without an apron
  EXPECT_GE(loaded, 3 * voxels);
  const std::uint64_t before = bytesAfter({0, 1, 2}, Filter::nearest);
  EXPECT_EQ(voxelBytes(), loaded);
  EXPECT_EQ(bytesAfter({0, 1, 2}, Filter::nearest), before);
  const std::uint64_t one = bytesAfter({1}, Filter::linear) - before;
  EXPECT_GE(one, voxels);
  EXPECT_EQ(bytesAfter({1}, Filter::linear), before + one);
  const std::uint64_t two = bytesAfter({0, 1}, Filter::linear) - before - one;  // no second grid
  EXPECT_GE(two, voxels);
  EXPECT_LT(two, one);
  for (const ResidentPart& part : volume->parts()) {
    EXPECT_TRUE(!part.apron || part.channel <= 1) << part.what << " of channel " << part.channel;
  }
  EXPECT_EQ(bytesAfter({0, 1, 2}, Filter::linear), before + one + 2 * two);
}

// A channel in which nothing can be seen costs nothing.
TEST_F(ThreeChannels, OfWhichOneShowsNothingAreDrawnWithoutIt) {
  View view = lookAt(twoViews(scene_)[0], kLooks[4]);
  view.channels[1].range = DensityRange{.lo = 1e9, .hi = 2e9};
  const Frame frame = draw(scene_, view);
  EXPECT_NE(frame.stats.kernel.find("2 channels"), std::string::npos) << frame.stats.kernel;
  view.channels[1].range.reset();
  view.drawn = {0, 2};
  EXPECT_EQ(draw(scene_, view).pixels, frame.pixels);
}

TEST_F(ThreeChannels, RefuseWhatIsNotDefined) {
  const auto fieldOf = [&](const View& view) {
    try {
      renderer().render(*scene_.resident, view, {});
    } catch (const ViewError& error) {
      return error.field;
    }
    return std::string();
  };
  View view;
  view.width = view.height = 8;
  view.drawn = {0, 3};
  EXPECT_EQ(fieldOf(view), "channels");
  view.drawn = {1, 1};
  EXPECT_EQ(fieldOf(view), "channels");
  view.drawn = {-1};
  EXPECT_EQ(fieldOf(view), "channels");
  view.drawn = {};
  view.channels[3].range = DensityRange{.lo = 1, .hi = 2};
  EXPECT_EQ(fieldOf(view), "range");
  view.channels[3] = {.range = {}, .transfer = {}, .transfer_preset = TransferPreset::viridis};
  EXPECT_EQ(fieldOf(view), "tf");
  view.channels[3] = {};
  view.channels[2].range = DensityRange{.lo = 2, .hi = 1};
  EXPECT_EQ(fieldOf(view), "range");
  view.channels[2] = {};
  view.output = Output::depth;
  for (const Mode mode : {Mode::mip, Mode::minip, Mode::attenuated_mip}) {
    view.mode = mode;
    EXPECT_EQ(fieldOf(view), "output");
  }
  view.drawn = {2};
  EXPECT_EQ(fieldOf(view), "");
}

}  // namespace
}  // namespace blockwalk::test
