// SPDX-License-Identifier: Apache-2.0
// Several samples a pixel: where they lie, what their mean is, and that nothing but the view decides over it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <random>
#include <thread>

#include "shaders/kernel_interface.h"
#include "tests/renderer/compare.h"
#include "tests/renderer/stage.h"
#include "tests/renderer/synthetic.h"
#include "tests/renderer/views.h"

namespace blockwalk::test {
namespace {

glm::dvec2 placeOf(int x, int y, int index) {
  return glm::dvec2(gpu::samplePlace({x, y}, static_cast<gpu::uint>(index)));
}

TEST(Samples, LieWhereTheDocumentSays) {
  const double g = 1.3247179572447460;
  EXPECT_NEAR(g * g * g, g + 1, 1e-12);
  for (const auto& [x, y] : {std::pair{0, 0}, {1, 0}, {0, 1}, {8191, 8191}, {640, 77}}) {
    const glm::dvec2 first = placeOf(x, y, 0);
    for (int i = 0; i < kMaxSamples; ++i) {
      const glm::dvec2 place = placeOf(x, y, i);
      const glm::dvec2 walked = glm::fract(first + static_cast<double>(i) / glm::dvec2(g, g * g));
      const glm::dvec2 apart = glm::abs(place - walked);
      EXPECT_LT(std::min(apart.x, 1 - apart.x), 2e-7) << i;
      EXPECT_LT(std::min(apart.y, 1 - apart.y), 2e-7) << i;
      EXPECT_LT(glm::length(place - reference::placeOfSample(x, y, i)), 1e-7) << i;
      EXPECT_TRUE(place.x >= 0 && place.x < 1 && place.y >= 0 && place.y < 1);
    }
  }
}

// How far the share of 64 points in a corner box [0, u) x [0, v) is from its area, at worst.
template <typename PlaceAt>
double discrepancy(PlaceAt place_at) {
  double worst = 0;
  std::array<glm::dvec2, 64> places;
  for (int i = 0; i < 64; ++i) places[static_cast<std::size_t>(i)] = place_at(i);
  for (int box = 0; box < 100; ++box) {
    const int column = box % 10, row = box / 10;
    const double u = 0.1 * (1 + column), v = 0.1 * (1 + row);
    const auto inside = std::ranges::count_if(places, [&](glm::dvec2 p) { return p.x < u && p.y < v; });
    worst = std::max(worst, std::abs(static_cast<double>(inside) / 64 - u * v));
  }
  return worst;
}

TEST(Samples, AreEvenlySpreadAndDifferBetweenPixels) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> number(0, 1);
  glm::dvec2 mean(0);
  double spread = 0, random_spread = 0;
  for (int pixel = 0; pixel < 400; ++pixel) {
    const int x = pixel % 20, y = pixel / 20;
    mean += placeOf(x, y, 0) / 400.0;
    spread += discrepancy([&](int i) { return placeOf(x, y, i); }) / 400;
    random_spread += discrepancy([&](int) {
                       const double a = number(generator), b = number(generator);
                       return glm::dvec2(a, b);
                     }) /
                     400;
  }
  EXPECT_LT(spread, random_spread / 2);
  std::printf("discrepancy %.4f, of random points %.4f\n", spread, random_spread);
  // Standard deviation of a mean of 400 random numbers: 0.0144.
  EXPECT_NEAR(mean.x, 0.5, 0.05);
  EXPECT_NEAR(mean.y, 0.5, 0.05);
}

class SamplesTest : public RendererTest {
 protected:
  static void expectMeans(Scene& scene, const std::vector<View>& views, const std::vector<Combination>& choices) {
    const reference::DenseVolume dense = scene.dense(0);
    ImageError total;
    for (const View& view : views) {
      const reference::Image expected = reference::renderImage(dense, view);
      const double near_jump = view.filter == Filter::linear ? 1e-5 * dense.contrast : 0;
      for (const Combination& choice : choices) {
        const ImageError error =
            compareToReference(draw(scene, with(view, choice)), expected, view.background, near_jump);
        EXPECT_LE(error.largest, 2) << toString(choice) << ", view " << toString(view) << ": " << error.worst;
        total.add(error);
      }
    }
    EXPECT_GE(total.psnr(), 55);
    EXPECT_GT(total.drawn * 10, total.channels / 4) << "too little to see";
    EXPECT_LE(total.skipped * 8, total.channels) << "too much skipped";
  }

  static View small(View view) {
    if (view.width * view.height > 64 * 64) view.width = 64, view.height = 48;
    return view;
  }
};

TEST_F(SamplesTest, AreAveragedAsTheReferenceAverages) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::rgba8, .dims = {70, 64, 57}}));
  std::vector<View> views;
  for (const View& view : randomViews(scene.info, scene.dense(0), 51)) {
    views.push_back(small(view));
    views.back().samples = 2 + static_cast<int>(views.size() % 6);
  }
  expectMeans(scene, views, combinations());
}

// Lit colours may exceed 1, and a background with opacity is averaged premultiplied.
TEST_F(SamplesTest, OfLitSurfacesAreAveragedAsDisplayed) {
  Scene scene = makeScene(
      *makeSynthetic({.type = VoxelType::u16, .dims = {61, 70, 49}, .seed = 3, .world_from_index = obliqueMap(false)}));
  std::vector<View> views;
  for (View view : randomViews(scene.info, scene.dense(0), 52)) {
    view.mode = Mode::iso;
    view.filter = Filter::linear;
    view.lit = true;
    view.background = {200, 100, 50, 99};
    for (TransferPoint& point : view.channels[0].transfer) point.color = glm::dvec3(1, 0.9, 0.95);
    view.samples = 5;
    views.push_back(small(view));
  }
  expectMeans(scene, views, {combinations().front(), combinations().back()});
}

// The edge of an opaque slab through pixels: a pixel's colour is the share of it that is covered, in closed form.
TEST_F(SamplesTest, ConvergeToTheShareThatIsCovered) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::rgba8, .dims = {64, 64, 64}}));
  View view;
  view.mode = Mode::first_hit;
  view.width = view.height = 16;
  view.level = 0;
  view.ortho_height = 16;  // a pixel a world unit
  view.eye = glm::dvec3(32, 32, 100);
  view.target = glm::dvec3(32, 32, 0);
  const Frame whole = draw(scene, view);
  view.background = {0, 0, 0, 0};
  view.samples = kMaxSamples;
  // Edges that run across the pixels' columns: x >= 32.3, then x + y / 2 >= 48.3.
  view.planes = {{{1, 0, 0}, -32.3}};
  const Frame straight = draw(scene, view);
  view.planes = {{{1, 0.5, 0}, -48.3}};
  const Frame oblique = draw(scene, view);
  std::size_t compared = 0;
  for (std::size_t i = 0; i < whole.pixels.size(); ++i) {
    if (whole.pixels[i] == 0xff000000u) continue;  // a gap of the volume
    const std::size_t row = i / 16;
    const double x = 24 + static_cast<double>(i % 16), y = 40 - static_cast<double>(row) - 1;
    EXPECT_NEAR(straight.pixels[i] >> 24, 255 * std::clamp(x + 1 - 32.3, 0.0, 1.0), 0.012 * 255 + 1) << i;
    double share = 0;  // the edge is a line: the mean of what is covered at many heights
    for (int k = 0; k < 1000; ++k) share += std::clamp(x + 1 - (48.3 - (y + (k + 0.5) / 1000) / 2), 0.0, 1.0) / 1000;
    EXPECT_NEAR(oblique.pixels[i] >> 24, 255 * share, 0.02 * 255 + 1) << i;
    ++compared;
  }
  EXPECT_GT(compared, 100u);
}

TEST_F(SamplesTest, DoNotDependOnBands) {
  const std::filesystem::path path =
      buildFile(*makeSynthetic({.type = VoxelType::rgba8, .dims = {70, 64, 57}, .seed = 6}));
  View view;
  view.width = 201;
  view.height = 150;
  view.samples = 11;
  view.background = {9, 8, 7, 40};
  std::vector<Frame> frames;
  for (double band_ms : {1e6, 0.01, 3.0}) {
    std::vector<std::string> messages;
    DeviceOptions options;
    options.band_ms = band_ms;
    options.validation = true;
    options.on_message = [&messages](const std::string& text) { messages.push_back(text); };
    const std::unique_ptr<Renderer> other = createRenderer(options);
    const std::unique_ptr<ResidentVolume> volume = other->load(VolumeFile(path));
    frames.push_back(draw(*other, *volume, view));
    EXPECT_EQ(messages, std::vector<std::string>{});
  }
  EXPECT_EQ(frames[0].pixels, frames[1].pixels);
  EXPECT_EQ(frames[0].pixels, frames[2].pixels);
  EXPECT_EQ(frames[0].stats.voxel_steps, frames[1].stats.voxel_steps);
  EXPECT_EQ(frames[0].stats.rays, 11u * 201 * 150);
}

TEST_F(SamplesTest, CancellingDoesNotWaitForAllOfThem) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::rgba8, .dims = {150, 140, 130}, .seed = 6}));
  View view;
  view.width = view.height = 4096;
  view.samples = kMaxSamples;  // four thousand million rays
  const auto cancel = std::make_shared<std::atomic<bool>>(false);
  std::jthread impatient([&cancel] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    cancel->store(true);
  });
  const auto begin = std::chrono::steady_clock::now();
  const Frame frame = renderer().render(*scene.resident, view, {.count = false, .cancel = cancel});
  EXPECT_TRUE(frame.cancelled);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
}

TEST_F(SamplesTest, OfNumbersAreRefused) {
  Scene scene = makeScene(*makeSynthetic({.type = VoxelType::rgba8, .dims = {40, 40, 40}}));
  const auto fieldOf = [&](Output output, int samples) {
    View view;
    view.width = view.height = 4;
    view.output = output;
    view.samples = samples;
    try {
      renderer().render(*scene.resident, view, {});
    } catch (const ViewError& error) {
      return error.field;
    }
    return std::string();
  };
  EXPECT_EQ(fieldOf(Output::color, 2), "");
  EXPECT_EQ(fieldOf(Output::depth, 1), "");
  EXPECT_EQ(fieldOf(Output::depth, 2), "samples");
  EXPECT_EQ(fieldOf(Output::position, 2), "samples");
  EXPECT_EQ(fieldOf(Output::cost, 2), "samples");
  EXPECT_EQ(fieldOf(Output::color, 0), "samples");
  EXPECT_EQ(fieldOf(Output::color, 257), "samples");
}

}  // namespace
}  // namespace blockwalk::test
